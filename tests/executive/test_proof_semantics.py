"""asp/tree_semantics.lp against py_trees itself, on random ticks of random trees.

Every tick of a tree is one copy of it in one program without choices: clingo only has to ground.
"""

from __future__ import annotations

import random
from dataclasses import dataclass, field
from itertools import count

import py_trees
import pytest
from clingo import Control, SymbolType
from py_trees.common import Status

from defras_bt.executive.composites import PlanSlot
from defras_bt.executive.loader import build_tree
from defras_bt.executive.node import NoParameters
from defras_bt.executive.proof.facts import LETTERS, Numbered, numbered, tree_facts
from defras_bt.executive.tree_kinds import kind_of
from defras_bt.executive.tree_spec import TreeSpec
from defras_sim.resources import resource
from tests.executive.random_trees import INNER, random_spec

TICKS = 20_000
TICKS_PER_PROGRAM = 1_000
TICKS_PER_TREE = 10
PLAN_LENGTH = 3
LEAVES = ("Think", "Push", "Watch", "plan_slot")
# What has been under a plan slot or a memory often enough to meet every order of stopping.
KINDS_DRAWN = (*INNER, *["sequence", "selector", "reactive", "reactive_selector", "parallel"] * 3)

TRACKING = ("sequence", "selector", "reactive_selector", "plan_slot")
"""Kinds to which it matters which child is the current one."""


@dataclass
class Traced:
    """A real tree whose leaves answer at random, with the events that the test traces."""

    chance: random.Random
    answers: dict[str, Status] = field(default_factory=dict)
    log: list[tuple[str, str]] = field(default_factory=list)
    events: list[tuple[str, str]] = field(default_factory=list)

    def next_status(self, name, default):
        return self.chance.choice([Status.SUCCESS, Status.FAILURE, Status.RUNNING])


def trace(behaviour, path, context):
    """Log each update and each ``terminate(INVALID)`` of ``behaviour`` under ``path``."""
    original = behaviour.terminate

    def terminate(new_status):
        if new_status == Status.INVALID:
            context.events.append((path, "stopped"))
        original(new_status)

    behaviour.terminate = terminate
    if not behaviour.children and not isinstance(behaviour, PlanSlot):
        update = behaviour.update

        def traced_update():
            context.events.append((path, "updated"))
            context.answers[path] = update()
            return context.answers[path]

        behaviour.update = traced_update


def due(behaviour):
    """Whether one more count and a counting decorator has reached its limit."""
    running = behaviour.status == Status.RUNNING
    match behaviour:
        case py_trees.decorators.Retry():
            return (behaviour.failures if running else 0) + 1 >= behaviour.num_failures
        case py_trees.decorators.Repeat():
            return (behaviour.success if running else 0) + 1 == behaviour.num_success
    ticks = getattr(behaviour, "ticks", None)
    return ticks is not None and (behaviour._run if running else 0) + 1 >= ticks


def state_of(pairs):
    """(node, behaviour) pairs as the facts about a state, without the predicate ``was`` written."""
    for node, behaviour in pairs:
        yield "was", node.number, LETTERS[behaviour.status]
        if behaviour.status == Status.RUNNING and kind_of(behaviour) in TRACKING:
            yield "cursor", node.number, behaviour.children.index(behaviour.current_child) + 1
        if isinstance(behaviour, PlanSlot) and not behaviour.needs_plan:
            yield "live", node.number
        if isinstance(behaviour, py_trees.decorators.OneShot) and behaviour.final_status:
            yield "latched", node.number, LETTERS[behaviour.final_status]


def behaviours_by_path(tree):
    identifiers = {behaviour.id: behaviour for behaviour in tree.root.iterate()}
    return {path: identifiers[identifier] for identifier, path in tree.paths().items()}


@dataclass
class Tick:
    """One tick of one tree: facts before, and what py_trees made of it."""

    root: Numbered
    facts: list[str]
    after: set[tuple]
    ticked: set[int]
    log: list[tuple[int, str]]


def run_tree(toys, spec, chance, numbers, ticks):
    """Tick a real tree at random, with plans put in between now and then."""
    context = Traced(chance)
    tree = build_tree(TreeSpec("n", "", spec), context)
    slots = [b for b in tree.root.iterate() if isinstance(b, PlanSlot)]
    traced = set()
    for _ in range(ticks):
        for slot in slots:
            if not slot.children or chance.random() < 0.15:
                names = [f"action {step}" for step in range(1, PLAN_LENGTH + 1)]
                slot.fill([toys.Push(name, context, NoParameters()) for name in names])
        behaviours = behaviours_by_path(tree)
        for path, behaviour in behaviours.items():
            if behaviour.id not in traced:
                traced.add(behaviour.id)
                trace(behaviour, path, context)
        root = numbered(spec, PLAN_LENGTH, numbers())
        nodes = {node.path: node for node in root.walk()}
        assert set(nodes) == set(behaviours)
        pairs = [(nodes[path], behaviour) for path, behaviour in behaviours.items()]
        facts = [f"{name}({','.join(map(str, values))})." for name, *values in state_of(pairs)]
        facts += [f"due({node.number})." for node, behaviour in pairs if due(behaviour)]
        context.answers.clear()
        context.events.clear()
        ticked = {behaviour.id for behaviour in tree.root.tick()}
        for path, node in nodes.items():
            if node.is_leaf:
                status = context.answers.get(path)
                letter = LETTERS[status] if status else chance.choice("sfr")
                facts.append(f"answer({node.number},{letter}).")
        yield Tick(
            root,
            [*tree_facts(root), *facts],
            set(state_of(pairs)),
            {node.number for node, behaviour in pairs if behaviour.id in ticked},
            [(nodes[path].number, what) for path, what in context.events],
        )


NEXT = {
    "after": "was",
    "next_cursor": "cursor",
    "next_live": "live",
    "next_latched": "latched",
}


def predicted(facts):
    """What the program says: the state after, who is ticked, and who is stopped by whom, when."""
    control = Control(["--warn=none"])
    control.load(str(resource("asp/tree_semantics.lp")))
    control.add("base", [], "\n".join(facts))
    control.ground([("base", [])])
    atoms = control.symbolic_atoms
    after, stops = set(), {}
    for name, before in NEXT.items():
        for atom in atoms.by_signature(name, 1 if name == "next_live" else 2):
            assert atom.is_fact
            values = atom.symbol.arguments
            plain = [v.number if v.type == SymbolType.Number else v.name for v in values]
            after.add((before, *plain))
    ticked = {atom.symbol.arguments[0].number for atom in atoms.by_signature("ticked", 1)}
    for phase in ("before", "behind"):
        for atom in atoms.by_signature(phase, 2):
            node, by = atom.symbol.arguments
            stops.setdefault(node.number, set()).add((phase, by.number))
    return after, ticked, stops


def spans(root):
    """Number of each node with the last number under it."""
    return {node.number: max(n.number for n in node.walk()) for node in root.walk()}


def assert_order(tick, stops):
    """Who is stopped, and each time on the right side of the updates under whoever stops it."""
    stopped = {number for number, what in tick.log if what == "stopped"}
    mine = {node.number for node in tick.root.walk()}
    assert stopped == {number for number in stops if number in mine}
    last_under = spans(tick.root)
    for number in stopped:
        seen = []
        for position, (logged, what) in enumerate(tick.log):
            if (logged, what) == (number, "stopped"):
                done = {n for n, w in tick.log[:position] if w == "updated"}
                coming = {n for n, w in tick.log[position:] if w == "updated"}
                seen.append((done, coming))
        outermost = {
            phase: min(c for p, c in stops[number] if p == phase) for phase, _ in stops[number]
        }
        innermost = {
            phase: max(c for p, c in stops[number] if p == phase) for phase, _ in stops[number]
        }
        if "before" in outermost:
            by = outermost["before"]
            assert all(not by <= n <= last_under[by] for n in seen[0][0])
        if "behind" in innermost:
            by = innermost["behind"]
            first = next(s for s in seen if "before" not in outermost or s is not seen[0])
            assert all(not by <= n <= last_under[by] for n in first[1])
            assert all(n <= last_under[by] for n in first[0])


def random_ticks(toys, chance, amount):
    free = count(0, 1000)
    while amount > 0:
        spec = random_spec(
            toys.registry, chance, inner=KINDS_DRAWN, leaves=LEAVES, most_children=3, deepest=4
        )
        for tick in run_tree(toys, spec, chance, lambda: next(free), min(TICKS_PER_TREE, amount)):
            amount -= 1
            yield tick


@pytest.mark.parametrize("batch", range(TICKS // TICKS_PER_PROGRAM))
def test_the_program_says_what_py_trees_does(toys, batch):
    ticks = list(random_ticks(toys, random.Random(batch), TICKS_PER_PROGRAM))
    assert len(ticks) == TICKS_PER_PROGRAM
    after, ticked, stops = predicted([fact for tick in ticks for fact in tick.facts])
    assert ticked == set().union(*(tick.ticked for tick in ticks))
    happened = set().union(*(tick.after for tick in ticks))
    assert after - happened == set()
    assert happened - after == set()
    for tick in ticks:
        assert_order(tick, stops)
