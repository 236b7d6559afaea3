"""Two trees are compared by what they mean; a lost guard is called out."""

import random
from dataclasses import replace
from itertools import pairwise

import pytest

from defras_bt.executive.node import NodeParameters
from defras_bt.executive.tree_diff import tree_diff
from defras_bt.executive.tree_file import read_tree
from defras_bt.executive.tree_spec import TreeSpec
from defras_sim.resources import resource
from tests.executive.port_toys import port_registry
from tests.executive.random_trees import random_spec
from tests.executive.unsafe_mutants import DEFRAS_MUTANTS, mutant

TREE = """
name: toy
metric: local
tree:
  reactive_selector:
    children:
      - reactive:
          name: operate
          children:
            - Watch
            - Limit: {name: force, limit_n: 0.3}
            - plan_slot: {name: act}
      - sequence: {name: after, children: [Think, Mend]}
"""


@pytest.fixture
def changes(write_tree, toys):
    """``changes(old text, new text)`` against TREE: the changes as lines."""

    def compare(*replaced, registry=toys.registry, text=TREE):
        new = text
        for before, after in replaced:
            assert before in new
            new = new.replace(before, after)
        old_tree = read_tree(write_tree(text, "old.yaml"), registry, must_be_guarded=False)
        new_tree = read_tree(write_tree(new, "new.yaml"), registry, must_be_guarded=False)
        return [str(change) for change in tree_diff(old_tree, new_tree)]

    return compare


def test_layout_and_files_mean_nothing(changes, write_tree):
    write_tree("name: after\ntree: {sequence: {children: [Think, {Mend: {}}]}}", "after.yaml")
    assert changes() == []
    assert (
        changes(
            ("- sequence: {name: after, children: [Think, Mend]}", "- subtree: {file: after.yaml}"),
            ("- Watch", "- Watch: {name: watch}  # as before"),
        )
        == []
    )


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        (
            "{name: force, limit_n: 0.3}",
            "{name: force, limit_n: 0.4}",
            ["~ toy/operate/force: limit_n is 0.4, not 0.3"],
        ),
        ("name: operate", "name: work", ["= toy/work: was called operate"]),
        ("metric: local", "metric: median", ["~ toy: listens to the metric median, not local"]),
        ("metric: local\n", "", ["~ toy: listens to no metric any more; it listened to local"]),
        (
            "children: [Think, Mend]",
            "children: [Mend, Think]",
            ["> toy/after/think: comes after mend now"],
        ),
        ("[Think, Mend]", "[Think]", ["- toy/after/mend: Mend is gone"]),
        ("[Think, Mend]", "[Think, Mend, {Mend: {name: more}}]", ["+ toy/after/more: Mend is new"]),
        (
            "            - Watch\n",
            "",
            [
                "! toy/operate/act: is no longer stopped in the same tick by toy/operate/watch",
                "- toy/operate/watch: Watch is gone",
            ],
        ),
        (
            "- Watch\n",
            "- ignore_failure: {child: Watch}\n",
            [
                "! toy/operate/act: is no longer stopped in the same tick by toy/operate/watch",
                "> toy/operate/ignore_failure/watch: stood under toy/operate",
                "+ toy/operate/ignore_failure: ignore_failure is new",
            ],
        ),
    ],
)
def test_changes_in_words(changes, before, after, expected):
    assert changes((before, after)) == expected


def test_a_metric_where_none_was(changes):
    given = TREE.replace("metric: local\n", "")
    with_metric = ("name: toy\n", "name: toy\nmetric: local\n")
    assert changes(with_metric, text=given) == [
        "~ toy: listens to the metric local now; it listened to none before"
    ]


def test_a_parameter_that_is_not_given_is_called_so(changes, toys):
    class EaseParameters(NodeParameters):
        after_s: float | None = None

    class Ease(toys.Watch):
        """Eases off, after a while if one is given."""

        Parameters = EaseParameters

    toys.registry.register(Ease)
    without = TREE.replace("- Watch", "- Ease: {name: ease}")
    given = TREE.replace("- Watch", "- Ease: {name: ease, after_s: 3.0}")
    assert changes(("name: ease", "name: ease, after_s: 3.0"), text=without) == [
        "~ toy/operate/ease: after_s is 3.0; it was not given before"
    ]
    assert changes((", after_s: 3.0", ""), text=given) == [
        "~ toy/operate/ease: after_s is not given any more; it was 3.0"
    ]


def test_another_kind_of_composite_says_what_that_means(changes):
    lost, also_lost, kind = changes(("- reactive:\n", "- sequence:\n"))
    assert lost == "! toy/operate/act: is no longer stopped in the same tick by toy/operate/force"
    assert also_lost.endswith("by toy/operate/watch")
    assert kind.startswith("~ toy/operate: is sequence (carries out its children one after the ot")
    assert "no longer reactive (every tick, ticks its children in order" in kind


def test_a_guard_that_moved_behind_the_motion_is_lost(changes):
    found = changes(
        ("            - Watch\n", ""),
        (
            "            - plan_slot: {name: act}\n",
            "            - plan_slot: {name: act}\n            - Watch\n",
        ),
    )
    assert found == [
        "! toy/operate/act: is no longer stopped in the same tick by toy/operate/watch",
        "> toy/operate/watch: comes after act now",
    ]


def test_a_guard_that_is_renamed_or_nested_is_not_lost(changes):
    assert changes(("- Watch\n", "- Watch: {name: eye}\n")) == [
        "= toy/operate/eye: was called watch"
    ]
    nested = changes(("- Watch\n", "- reactive: {name: both, children: [Watch]}\n"))
    assert not [line for line in nested if line.startswith("!")]


def test_what_ports_are_given_counts(write_tree):
    text = """
name: toy
tree:
  sequence:
    children: [{Measure: {ports: {tension_n: left}}}, {Hold: {ports: {wanted_n: left}}}]
"""
    registry = port_registry()
    old = read_tree(write_tree(text, "old.yaml"), registry)
    new = read_tree(
        write_tree(text.replace("wanted_n: left", "wanted_n: 0.5"), "new.yaml"), registry
    )
    assert [str(change) for change in tree_diff(old, new)] == [
        "~ toy/hold: port wanted_n is 0.5, not the key left"
    ]


def test_every_unsafe_mutant_differs_and_lost_guards_are_called_out():
    tree = read_tree(resource("trees") / "defras.yaml")
    assert tree_diff(tree, tree) == []
    for name in DEFRAS_MUTANTS:
        kinds = {change.kind for change in tree_diff(tree, mutant(tree, name))}
        assert kinds, name
        assert ("guard lost" in kinds) == (name not in KEEP_THEIR_GUARDS), name


KEEP_THEIR_GUARDS = {
    "warning state 2 is let pass",
    "the force may be too high for ten seconds",
    "no human at warning state 3",
    "no human when the operator stops",
    "a running branch keeps its turn",
    "recovery before the human",
    "jaws open without a look at the sensors",
    "letting go is not interrupted",
    "everything beside everything",
    "the human is asked beside the rest",
}
"""Mutants in which what guards the plan stays as it is; they are unsafe for another reason."""


def test_random_trees_differ_from_themselves_by_nothing_and_from_others_by_something(toys):
    chance = random.Random(4)
    trees = [TreeSpec("n", "", random_spec(toys.registry, chance)) for _ in range(60)]
    for one, other in pairwise(trees):
        assert tree_diff(one, one) == []
        assert bool(tree_diff(one, other)) == (one != other)
        root = one.root
        if root.kind == "sequence" and len(root.children) > 1:
            turned = replace(one, root=replace(root, children=root.children[::-1]))
            assert {change.kind for change in tree_diff(one, turned)} <= {"moved", "guard lost"}
