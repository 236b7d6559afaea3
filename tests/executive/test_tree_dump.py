"""A tree that is written reads as the same tree; fuzzed files are read or refused, never worse."""

import random

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from defras_bt.executive.tree_diff import tree_diff
from defras_bt.executive.tree_dump import dump_tree
from defras_bt.executive.tree_file import read_tree
from defras_bt.executive.tree_spec import TreeSpec
from defras_sim.resources import resource
from defras_sim.yaml_source import InvalidFile
from tests.executive.fuzz_trees import fuzz
from tests.executive.json_schema import against_schema
from tests.executive.port_toys import port_registry
from tests.executive.random_trees import random_spec
from tests.executive.test_tree_ports import HOLD, MEASURE


def plain(tree):
    """All that a tree says, without the places at which it says it."""
    return [(path, spec.kind, spec.options, dict(spec.keys)) for path, spec in tree.root.walk()], (
        tree.name,
        tree.description.strip(),
        tree.metric,
    )


@pytest.mark.parametrize("file", sorted(p.name for p in resource("trees").glob("*.yaml")), ids=str)
def test_shipped_trees_are_the_same_after_a_round_trip(file, tmp_path):
    tree = read_tree(resource("trees") / file)
    text = dump_tree(tree)
    assert "subtree" not in text
    (tmp_path / file).write_text(text)
    again = read_tree(tmp_path / file)
    assert plain(again) == plain(tree)
    assert dump_tree(again) == text


seeds = st.integers(0, 2**32 - 1).map(random.Random)


@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(chance=seeds)
def test_random_trees_are_the_same_after_a_round_trip(chance, toys, tmp_path):
    """No valid file is rejected, and what it says is what is read."""
    spec = random_spec(toys.registry, chance, leaves=("Watch", "Push", "Think", "Mend"))
    tree, file = TreeSpec("n", "", spec), tmp_path / "random.yaml"
    text = dump_tree(tree)
    assert against_schema(text, toys.registry.nodes()) == []
    file.write_text(text)
    again = read_tree(file, toys.registry, must_be_guarded=False)
    assert plain(again) == plain(tree)
    assert tree_diff(tree, again) == []


def test_ports_are_the_same_after_a_round_trip(write_tree):
    registry = port_registry()
    write_tree(HOLD, "hold.yaml")
    write_tree(MEASURE, "measure.yaml")
    tree = read_tree(
        write_tree("""
name: toy
ports: {given_n: {type: number, direction: in, description: From outside.}}
tree:
  sequence:
    children:
      - subtree: {file: measure.yaml}
      - subtree: {file: measure.yaml, name: again, ports: {tension_n: left}}
      - subtree: {file: hold.yaml, ports: {wanted_n: left}}
      - subtree: {file: hold.yaml, name: strong, ports: {wanted_n: 2}}
      - Hold: {name: outside, ports: {wanted_n: given_n}}
"""),
        registry,
    )
    again = read_tree(write_tree(dump_tree(tree), "again.yaml"), registry)
    assert list(again.needs) == ["given_n"]
    assert sorted(again.values.values()) == [2.0]

    def meetings(of):
        """Which ports stand under one key."""
        by_key = {}
        for path, spec in of.root.walk():
            for port, key in spec.keys.items():
                by_key.setdefault(key, set()).add((path, port))
        return {frozenset(ports) for ports in by_key.values()}

    assert meetings(again) == meetings(tree)


# Trees that are valid but for one thing, which has to be refused.

INVALID = {
    "an unknown node": lambda text: text.replace("Think", "Thinkk", 1),
    "an unknown key": lambda text: text.replace("children:", "childrens:", 1),
    "no children": lambda text: text.replace("children:", "children: []\n#", 1),
    "one child in a list": lambda text: text.replace("child:", "child: [Think]\n#", 1),
    "an unknown top key": lambda text: text + "\nauthor: me\n",
    "a tree without a name": lambda text: text.replace("name: n", "", 1),
    "a name with capitals": lambda text: text.replace("name: n", "name: N", 1),
    "a metric that is not there": lambda text: "metric: mean\n" + text,
    "two trees": lambda text: text + "\ntree: Think\n",
    "a negative count": lambda text: text.replace("attempts: ", "attempts: -", 1),
    "a port of a leaf without one": lambda text: text.replace(
        "Think: {", "Think: {ports: {x: y}, ", 1
    ),
}


@settings(max_examples=80, suppress_health_check=list(HealthCheck))
@given(what=st.sampled_from(sorted(INVALID)), chance=seeds)
def test_no_tree_with_one_thing_wrong_is_accepted(what, chance, toys, tmp_path):
    spec = random_spec(toys.registry, chance, leaves=("Think", "Mend"), deepest=3)
    text = dump_tree(TreeSpec("n", "", spec))
    wrong = INVALID[what](text)
    assume(wrong != text)
    file = tmp_path / "invalid.yaml"
    file.write_text(wrong)
    with pytest.raises(InvalidFile):
        read_tree(file, toys.registry)


def test_fuzzed_files_are_read_or_refused(tmp_path):
    answers = fuzz(600, 1, tmp_path)
    assert set(answers) == {"read", "refused"}, answers
    assert answers["read"] > 20
