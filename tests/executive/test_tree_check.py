"""Guards stand before motions; and what the check accepts is safe when it is ticked."""

import random

import py_trees
import pytest
from py_trees.common import Status

from defras_bt.executive.loader import build_tree
from defras_bt.executive.tree_check import check_tree, guards
from defras_bt.executive.tree_file import read_tree
from defras_bt.executive.tree_spec import TreeSpec
from defras_sim.yaml_source import InvalidFile
from tests.executive.random_trees import INNER, random_spec, spec_of

SAFE = [
    "reactive: {children: [Watch, Push]}",
    "reactive: {children: [Think, Watch, {sequence: {children: [Think, Push]}}]}",
    "reactive: {children: [{reactive: {children: [Think, Watch]}}, {plan_slot: {name: act}}]}",
    "reactive: {children: [{selector: {children: [Watch, {Watch: {name: b}}]}}, Push]}",
    "reactive: {children: [{parallel: {succeed_when: all, children: [Think, Watch]}}, Push]}",
    "reactive: {children: [{parallel: {succeed_when: [watch], children: [Think, Watch]}}, Push]}",
    "sequence: {children: [Think, {reactive: {children: [Watch, {retry: {attempts: 2, "
    "child: Push}}]}}]}",
]
UNSAFE = [
    "Push",
    "plan_slot",
    "sequence: {children: [Watch, Push]}",
    "reactive: {children: [Push, Watch]}",
    "reactive: {children: [Think, Push]}",
    "selector: {children: [Watch, Push]}",
    "parallel: {succeed_when: all, children: [Watch, Push]}",
    "reactive: {children: [{invert: {child: Watch}}, Push]}",
    "reactive: {children: [{ignore_failure: {child: Watch}}, Push]}",
    "reactive: {children: [{sequence: {children: [Watch, Think]}}, Push]}",
    "reactive: {children: [{selector: {children: [Watch, Think]}}, Push]}",
    "reactive: {children: [{parallel: {succeed_when: one, children: [Watch, Think]}}, Push]}",
    "reactive: {children: [Think, {reactive: {children: [Push]}}]}",
    "reactive: {children: [{parallel: {succeed_when: all, synchronise: true, "
    "children: [Watch, Think]}}, Push]}",
    "reactive: {children: [{parallel: {succeed_when: [think], children: [Watch, Think]}}, Push]}",
    "reactive: {children: [{once: {child: Watch}}, Push]}",
]


def flow(text):
    """A tree file with ``text`` as its one node, in the second line."""
    return f"name: toy\ntree: {{{text}}}\n" if ":" in text else f"name: toy\ntree: {text}\n"


@pytest.mark.parametrize("text", SAFE)
def test_a_guard_before_the_motion_under_a_reactive_is_enough(write_tree, toys, text):
    read_tree(write_tree(flow(text)), toys.registry)


@pytest.mark.parametrize("text", UNSAFE)
def test_a_motion_without_a_guard_before_it_is_a_fault(write_tree, toys, text):
    with pytest.raises(InvalidFile) as raised:
        read_tree(write_tree(flow(text)), toys.registry)
    (fault,) = raised.value.faults
    assert "no guard stands before it" in fault.message
    assert "`reactive`, after a guard (Limit, Watch)" in fault.message
    column = flow(text).splitlines()[1].find("Push") + 1 if ":" in text else 1
    assert (fault.line, fault.column) == (2, column)


def test_a_tree_has_one_plan_slot(write_tree, toys):
    text = "reactive: {children: [Watch, plan_slot, {plan_slot: {name: other}}]}"
    with pytest.raises(InvalidFile, match=r"a second plan_slot \(toy/other\).* at toy/plan_slot"):
        read_tree(write_tree(flow(text)), toys.registry)


# The check against py_trees itself: random trees, random answers of every leaf.

# Mostly reactive, or few of the trees would be guarded at all.
MANY_REACTIVE = (*INNER, *["reactive"] * 14)


def guards_before(behaviour, toys):
    """Guard leaves that stand before ``behaviour`` under the reactive nodes above it."""
    found = set()
    while (parent := behaviour.parent) is not None:
        if isinstance(parent, py_trees.composites.Sequence) and not parent.memory:
            for sibling in parent.children[: parent.children.index(behaviour)]:
                found |= {leaf for leaf in sibling.iterate() if isinstance(leaf, toys.Watch)}
        behaviour = parent
    return found


def breaches(root, toys, ticks):
    """(motions ticked, motions that no guard let pass or that run on without being ticked)."""
    motions = {
        leaf: guards_before(leaf, toys) for leaf in root.iterate() if type(leaf) is toys.Push
    }
    ticked_in_all, breached = 0, 0
    for _ in range(ticks):
        passed, ticked = set(), set()
        for node in root.tick():
            if node in motions:
                ticked.add(node)
                breached += not passed & motions[node]
            elif isinstance(node, toys.Watch) and node.status == Status.SUCCESS:
                passed.add(node)
        breached += sum(leaf.status == Status.RUNNING and leaf not in ticked for leaf in motions)
        ticked_in_all += len(ticked)
    return ticked_in_all, breached


class Chance:
    """A context under which every leaf answers at random."""

    def __init__(self, chance):
        self.chance, self.log = chance, []

    def next_status(self, name, default):
        return self.chance.choice([Status.SUCCESS, Status.FAILURE, Status.RUNNING])


def test_the_check_agrees_with_what_py_trees_does(toys):
    """Accepted: a motion is ticked only after a guard before it succeeded in the same tick, and
    does not run on in a tick without. Refused: that happens."""
    chance = random.Random(1)
    ticked, breached = {True: 0, False: 0}, {True: 0, False: 0}
    for _ in range(2500):
        spec = random_spec(toys.registry, chance, inner=MANY_REACTIVE, guard_first=0.6)
        accepted = not list(check_tree(spec, ()))
        root = build_tree(TreeSpec("n", "", spec), Chance(chance)).root
        motions, wrong = breaches(root, toys, ticks=5)
        ticked[accepted] += motions
        breached[accepted] += wrong
    assert ticked[True] > 500
    assert breached[True] == 0
    assert breached[False] > 500


def test_what_counts_as_a_guard(toys):
    watch, think = spec_of(toys.registry, "Watch"), spec_of(toys.registry, "Think")
    assert guards(watch)
    assert not guards(think)
    assert guards(spec_of(toys.registry, "reactive_selector", [watch, watch]))
    assert not guards(spec_of(toys.registry, "retry", [watch], attempts=2))
