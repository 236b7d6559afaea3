"""Trees to BehaviorTree.CPP's XML and back; what would mean something else is refused."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from xml.etree import ElementTree

import pytest
from py_trees.common import Status

from defras_bt.executive.node import Node, NodeParameters
from defras_bt.executive.registry import NODES, Registry, registered_nodes
from defras_bt.executive.tree_decorators import DECORATORS
from defras_bt.executive.tree_dump import dump_tree
from defras_bt.executive.tree_file import read_tree
from defras_bt.executive.tree_kinds import KINDS
from defras_bt.interop.groot_export import CannotExport, groot_xml
from defras_bt.interop.groot_import import import_groot
from defras_bt.interop.groot_kinds import OTHER, SAME, groot_id, kind_of_id
from defras_sim.resources import resource
from defras_sim.yaml_source import InvalidFile

TREES = sorted(path.stem for path in resource("trees").glob("*.yaml"))
EVERY_KIND = """
name: every
description: "Two lines,\\nwith <signs> & \\"quotes\\"."
metric: median
tree:
  reactive:
    children:
      - SensorsFresh
      - parallel: {succeed_when: all, children: [OperatorPermits, {invert: {child: RegionVisible}}]}
      - retry: {attempts: 3, child: {repeat: {times: 2, child: {Wait: {seconds: 0.25}}}}}
      - success_is_failure: {child: {success_is_running: {child: RestCalibrated}}}
      - Replan: {exposing: [pull], rehearse: 3}
      - plan_slot: {name: act}
"""


def through_xml(tree, tmp_path: Path, registry=NODES):
    file = tmp_path / "tree.xml"
    file.write_text(groot_xml(tree, registry.nodes()), encoding="utf-8")
    return import_groot(file, registry)


def faults(tmp_path: Path, xml: str) -> list[str]:
    file = tmp_path / "in.xml"
    file.write_text(xml, encoding="utf-8")
    with pytest.raises(InvalidFile) as caught:
        import_groot(file)
    return [str(fault).partition("in.xml:")[2] for fault in caught.value.faults]


def tree_of(*lines: str) -> str:
    inside = "\n".join(lines)
    return f'<root BTCPP_format="4">\n<BehaviorTree ID="mine">\n{inside}\n</BehaviorTree>\n</root>'


class TestRoundTrip:
    @pytest.mark.parametrize("name", TREES)
    def test_shipped_trees(self, name, tmp_path):
        tree = read_tree(resource(f"trees/{name}.yaml"), must_be_guarded=False)
        assert dump_tree(through_xml(tree, tmp_path)) == dump_tree(tree)

    @pytest.mark.parametrize("kind", sorted(DECORATORS))
    def test_every_decorator(self, kind, tmp_path, write_tree):
        options = {
            name: {"ticks": 3, "until": "completion", "status": "failure"}.get(name, 2)
            for name in DECORATORS[kind].options.model_fields
        }
        said = "".join(f"{name}: {value}, " for name, value in options.items())
        tree = read_tree(write_tree(f"name: t\ntree: {{{kind}: {{{said}child: SensorsFresh}}}}"))
        assert dump_tree(through_xml(tree, tmp_path)) == dump_tree(tree)

    @pytest.mark.parametrize("succeed_when", ["all", "one", "[first]", "[first, second]"])
    def test_every_parallel(self, succeed_when, tmp_path, write_tree):
        children = "[{SensorsFresh: {name: first}}, {SensorsFresh: {name: second}}]"
        text = f"{{parallel: {{succeed_when: {succeed_when}, children: {children}}}}}"
        tree = read_tree(write_tree(f"name: t\ntree: {text}"))
        assert dump_tree(through_xml(tree, tmp_path)) == dump_tree(tree)

    def test_every_kind_of_value(self, tmp_path, write_tree):
        tree = read_tree(write_tree(EVERY_KIND))
        again = through_xml(tree, tmp_path)
        assert dump_tree(again) == dump_tree(tree)
        assert again.description == tree.description
        replan = next(node for path, node in again.root.walk() if node.kind == "Replan")
        assert (replan.options.exposing, replan.options.rehearse) == (("pull",), 3)


class TestExport:
    def test_it_is_the_form_that_behaviortree_cpp_reads(self):
        xml = groot_xml(read_tree(resource("trees/defras.yaml")), registered_nodes())
        root = ElementTree.fromstring(xml.encode())
        assert (root.tag, root.attrib["BTCPP_format"]) == ("root", "4")
        assert root.attrib["main_tree_to_execute"] == "defras"
        (tree,) = root.findall("BehaviorTree")
        assert len(tree) == 1
        (models,) = root.findall("TreeNodesModel")
        modelled = {model.attrib["ID"]: model for model in models}
        for element in tree.iter():
            if element is tree or element.tag in SAME.values():
                continue
            ports = {port.attrib["name"] for port in modelled[element.tag].findall("input_port")}
            assert set(element.attrib) - {"name"} <= ports, element.tag

    def test_a_guard_is_a_condition_with_its_ports_and_defaults(self):
        xml = groot_xml(read_tree(resource("trees/fras.yaml")), registered_nodes())
        guard = ElementTree.fromstring(xml.encode()).find(".//Condition[@ID='ForceAccepted']")
        (port,) = guard.findall("input_port")
        assert (port.attrib["name"], port.attrib["default"]) == ("patience_s", "0.5")

    def test_values_without_counterpart_are_refused(self, write_tree):
        registry = Registry()
        registry.register(Say)
        tree = read_tree(write_tree("name: talk\ntree: {Say: {text: '{key}'}}"), registry)
        with pytest.raises(CannotExport, match=r"talk\.text: '{key}' has no counterpart"):
            groot_xml(tree, registry.nodes())


class TestKinds:
    def test_every_kind_has_an_id_of_its_own(self):
        assert {kind_of_id(groot_id(kind)) for kind in KINDS} == set(KINDS)

    @pytest.mark.parametrize(
        ("kind", "shows"),
        [
            # What decorators of BehaviorTree.CPP 4.6 return: inverter_node.h, force_success_node.h,
            # force_failure_node.h, keep_running_until_failure_node.h.
            ("invert", {"SUCCESS": "FAILURE", "FAILURE": "SUCCESS", "RUNNING": "RUNNING"}),
            ("ignore_failure", {"SUCCESS": "SUCCESS", "FAILURE": "SUCCESS", "RUNNING": "RUNNING"}),
            (
                "success_is_failure",
                {"SUCCESS": "FAILURE", "FAILURE": "FAILURE", "RUNNING": "RUNNING"},
            ),
            (
                "success_is_running",
                {"SUCCESS": "RUNNING", "FAILURE": "FAILURE", "RUNNING": "RUNNING"},
            ),
        ],
    )
    def test_decorators_that_are_the_same_show_the_same(self, kind, shows):
        ours = {s.name: DECORATORS[kind].shows[s].name for s in DECORATORS[kind].shows}
        assert ours == shows

    @pytest.mark.parametrize("kind", ["sequence", "reactive", "selector", "reactive_selector"])
    def test_composites_that_are_the_same_tick_the_same(self, kind, load_toys, toy_context):
        """Against BehaviorTree.CPP's own loops, written down from its sources, from every start."""
        names = ("a", "b", "c")
        statuses = ("SUCCESS", "FAILURE", "RUNNING")
        combinations = list(product(statuses, repeat=3))
        for first, second in product(combinations, combinations[::4]):
            tree = load_toys(f"{kind}: {{children: [{', '.join(_toy(n) for n in names)}]}}")
            theirs = _BtCpp(kind)
            for said in (first, second, first):
                for name, status in zip(names, said, strict=True):
                    toy_context.says[name] = [Status[status]]
                toy_context.log.clear()
                tree.root.tick_once()
                ticked = [name for name, what in toy_context.log if not what.startswith("ends")]
                expected = theirs.tick(dict(zip(names, said, strict=True)))
                assert (tree.root.status.name, ticked) == expected


class TestImport:
    def test_a_tree_written_elsewhere(self, tmp_path):
        file = tmp_path / "in.xml"
        file.write_text(
            '<root BTCPP_format="4" main_tree_to_execute="mine">\n'
            '  <BehaviorTree ID="mine"><ReactiveSequence>\n'
            '    <Condition ID="SensorsFresh"/><SubTree ID="rest"/>\n'
            "  </ReactiveSequence></BehaviorTree>\n"
            '  <BehaviorTree ID="rest"><Sequence name="patience">\n'
            '    <Wait seconds="3"/><Action ID="AskHuman" name="help"/>\n'
            "  </Sequence></BehaviorTree>\n"
            "</root>",
            encoding="utf-8",
        )
        paths = [path for path, _ in import_groot(file).root.walk()]
        assert paths == [
            "mine",
            "mine/sensors_fresh",
            "mine/patience",
            "mine/patience/wait",
            "mine/patience/help",
        ]

    @pytest.mark.parametrize("identifier", sorted(OTHER))
    def test_nodes_of_another_meaning_are_refused_with_the_reason(self, identifier, tmp_path):
        (fault,) = faults(tmp_path, tree_of(f"<{identifier}><SensorsFresh/></{identifier}>"))
        assert fault.startswith("3:1: ")
        assert f"{identifier} has no counterpart here: {OTHER[identifier]}" in fault

    def test_all_faults_with_their_lines(self, tmp_path):
        found = faults(
            tmp_path,
            tree_of(
                '<Sequence _skipIf="x">',
                '<Wait seconds="{time}"/>',
                "<Parallel><SensorsFresh/></Parallel>",
                "<Inverter/>",
                "</Sequence>",
            ),
        )
        assert {"3", "4", "5"} <= {fault.split(":")[0] for fault in found}

    @pytest.mark.parametrize(
        ("xml", "message"),
        [
            (
                tree_of("<SensorFresh/>"),
                "there is no node 'SensorFresh'; did you mean SensorsFresh",
            ),
            (tree_of('<Wait second="3"/>'), "did you mean seconds"),
            (tree_of('<Wait seconds="-3"/>'), "greater than 0"),
            (tree_of("<SensorsFresh><Finish/></SensorsFresh>"), "is a leaf"),
            (tree_of('<SubTree ID="mine"/>'), "holds itself"),
            (tree_of('<SubTree ID="other"/>'), "there is no tree 'other'"),
            (tree_of('<SubTree ID="mine" a="{b}"/>'), "ports of subtrees"),
            (tree_of("<SensorsFresh/>", "<Finish/>"), "holds one node, not 2"),
            ('<root BTCPP_format="3"/>', 'should be <root BTCPP_format="4">'),
            ('<root BTCPP_format="4"/>', "main_tree_to_execute should name a tree"),
            ("<root", "no XML"),
            ("", "no XML"),
            ('<!DOCTYPE r [<!ENTITY a "b">]><root BTCPP_format="4"/>', "document type"),
        ],
    )
    def test_what_is_wrong_is_said(self, xml, message, tmp_path):
        assert any(message in fault for fault in faults(tmp_path, xml))


def _toy(name: str) -> str:
    return f"{{Think: {{name: {name}}}}}"


class SayParameters(NodeParameters):
    text: str


class Say(Node):
    """Says something."""

    role = "task"
    Parameters = SayParameters

    def update(self) -> Status:
        return self.succeed("said", self.parameters.text)


class _BtCpp:
    """sequence_node.cpp, reactive_sequence.cpp, fallback_node.cpp, reactive_fallback.cpp of 4.6."""

    def __init__(self, kind: str) -> None:
        self.reactive = kind.startswith("reactive")
        self.goes_on, self.stops = (
            ("FAILURE", "SUCCESS") if kind.endswith("selector") else ("SUCCESS", "FAILURE")
        )
        self.index = 0

    def tick(self, says: dict[str, str]) -> tuple[str, list[str]]:
        names, ticked = list(says), []
        index = 0 if self.reactive else self.index
        while index < len(names):
            ticked.append(names[index])
            status = says[names[index]]
            if status == "RUNNING":
                self.index = index
                return status, ticked
            if status == self.stops:
                self.index = 0
                return status, ticked
            index += 1
        self.index = 0
        return self.goes_on, ticked
