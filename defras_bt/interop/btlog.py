"""The log of a run in the format of BehaviorTree.CPP's FileLogger2, which Groot2 replays.

Layout, little-endian, as ``bt_file_logger_v2.cpp`` of version 4.6 writes it: 18 letters, a byte 1,
the size of the XML as int32, the XML, the first microsecond as int64, then 9 bytes a change of
status: 6 of microseconds since the first, 2 of the node's number, 1 of its status.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from xml.etree.ElementTree import Element, SubElement

from defras_bt.acting.actions import LEAVES
from defras_bt.executive.again import unpack_tree
from defras_bt.executive.node import Node
from defras_bt.executive.tree_file import read_tree
from defras_bt.executive.tree_spec import TreeSpec
from defras_bt.interop.groot_export import CannotExport, groot_xml
from defras_bt.recording.decision_reader import Decisions, read_decisions
from defras_bt.recording.inputs_reader import read_inputs

MAGIC = b"BTCPP4-FileLogger2"
PROTOCOL = 1
IDLE, RUNNING, SUCCESS, FAILURE = range(4)
STATUSES = {"": IDLE, "RUNNING": RUNNING, "SUCCESS": SUCCESS, "FAILURE": FAILURE}
MOST_NODES = 2**16 - 1


def btlog_of_run(run: Path, leaves: Mapping[str, type[Node]]) -> bytes:
    """The log of a recorded run, with the tree as it was then. Time 0 is the world's.

    Actions of plans stand under the plan slot, each once, whatever plan they came from.

    Raises:
        NoInputs, InvalidDecisions: it is not there.
        InvalidFile: the recorded tree needs leaves that are not installed.
        CannotExport: the tree has no counterpart in XML, or too many nodes.
    """
    decisions, inputs = read_decisions(run), read_inputs(run)
    with TemporaryDirectory() as folder:
        tree = read_tree(unpack_tree(inputs.setup["again"], Path(folder)))
    xml, numbers = _numbered_xml(tree, decisions, leaves)
    text = xml.encode()
    head = MAGIC + struct.pack("<Bi", PROTOCOL, len(text)) + text + struct.pack("<q", 0)
    return head + b"".join(_changes(decisions, numbers))


def _numbered_xml(
    tree: TreeSpec, decisions: Decisions, leaves: Mapping[str, type[Node]]
) -> tuple[str, Mapping[str, int]]:
    """The tree with every action that was ever in it, and the number of each node by path."""
    numbers: dict[str, int] = {}
    slots = [path for path, node in tree.root.walk() if node.kind == "plan_slot"]
    seen = dict.fromkeys(path for moment in decisions.moments() for path in moment.nodes)

    def number(path: str, element: Element) -> None:
        numbers[path] = len(numbers) + 1
        element.set("_uid", str(numbers[path]))
        if path in slots:
            for action in (p for p in seen if p.startswith(f"{path}/")):
                name = action.rpartition("/")[2]
                leaf = LEAVES[name.split("_")[1]].__name__
                number(action, SubElement(element, leaf, name=name))

    xml = groot_xml(tree, leaves, number, with_builtins=True)
    if len(numbers) > MOST_NODES:
        raise CannotExport(f"a log numbers {MOST_NODES} nodes, {tree.name} has {len(numbers)}")
    return xml, numbers


def _changes(decisions: Decisions, numbers: Mapping[str, int]) -> Iterator[bytes]:
    before = dict.fromkeys(numbers, IDLE)
    for moment in decisions.moments():
        microseconds = struct.pack("<Q", round(1e6 * moment.time_s))[:6]
        for path, number in numbers.items():
            word = moment.nodes.get(path)
            status = STATUSES[word.status] if word is not None and word.ticked else IDLE
            if status != before[path]:
                before[path] = status
                yield microseconds + struct.pack("<HB", number, status)
