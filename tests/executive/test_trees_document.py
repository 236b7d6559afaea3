"""What docs/trees.md shows is true."""

import re
from pathlib import Path

import pytest
from py_trees.common import Status

from defras_bt.executive.node import Node
from defras_bt.executive.ports import Writes, ports_of
from defras_bt.executive.proof.prover import prove
from defras_bt.executive.registry import Registry
from defras_bt.executive.tree_file import SUBTREE, read_tree
from defras_bt.executive.tree_kinds import KINDS

TEXT = (Path(__file__).parents[2] / "docs" / "trees.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", TEXT, re.DOTALL)


@pytest.mark.parametrize("text", blocks("yaml"), ids=lambda text: text.split()[1])
def test_the_trees_are_valid_and_safe(text, tmp_path):
    file = tmp_path / "tree.yaml"
    file.write_text(text)
    assert prove(read_tree(file), [1]).holds


def test_every_kind_is_explained():
    first_column = re.findall(r"^\| (`.*?`) \|", TEXT, re.MULTILINE)
    named = set(re.findall(r"`(\w+)`", " ".join(first_column)))
    assert named == {*KINDS, SUBTREE}


def test_the_classes_can_be_registered():
    registry = Registry()
    for code in blocks("python"):
        names = {"Node": Node, "Writes": Writes, "Status": Status, "__name__": "document"}
        exec(code, names)
        made = [v for v in names.values() if isinstance(v, type) and v.__module__ == "document"]
        for node_class in made:
            registry.register(node_class)
    assert list(registry.nodes()) == ["MeasureTension", "ProbeIsWarm"]
    assert list(ports_of(registry.nodes()["MeasureTension"])) == ["tension_n"]
    probe = registry.nodes()["ProbeIsWarm"]
    assert probe.promise(None, "readings", "missing") == Status.FAILURE
