"""Proofs about trees: one tick from any state, and examples of what goes wrong.

A tick is a finite function of what composites remember and what leaves answer, so it is enough to
look at one tick from an *arbitrary* well-kept state, and to prove that every tick and every new
plan leave the tree well kept. clingo looks for a state and answers that break a claim; that there
are none is the proof.

Plans. A plan slot carries its actions out as a sequence with memory, so the actions that it ticks
in one tick are neighbours, and all but the last of them succeed. Take any tick of a tree whose slot
holds n actions, and any action i of it. Put all actions before i together into one, and all after i
into another: a block is the current child if one of its actions was, runs if one of them ran, is
ticked if one of them is, and then shows what the last one ticked in it shows. The slot of at most
three actions shows the same in every tick, ticks and stops i in the same ticks, and is well kept if
the other was. So whatever can happen to an action of a long plan can happen to one of a plan of at
most three, and it is enough to prove the claims for plans of none to three actions.

What is taken for granted: leaves command in ``update()`` only, which the command gate sees to, and
keep the promises in promises.py, which tests see to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from clingo import Control, Function, Model, Symbol

from defras_bt.executive.proof.claims import Claim, claim_facts, claims_of
from defras_bt.executive.proof.facts import Numbered, numbered, tree_facts
from defras_bt.executive.proof.guards import guard_facts
from defras_bt.executive.proof.promises import leaf_facts
from defras_bt.executive.proof.replay import replay
from defras_bt.executive.proof.trace import Trace, read_trace
from defras_bt.executive.tree_spec import TreeSpec
from defras_sim.resources import resource

PLAN_LENGTHS = (0, 1, 2, 3)
"""Enough for plans of any length; see above."""

LONGEST_EXAMPLE = 4
"""Ticks from the start within which an example that can happen is looked for."""


@dataclass(frozen=True)
class Refutation:
    """A claim that does not hold, with the ticks that break it.

    ``happens``: the trace leads there from the start of an operation; otherwise its one tick starts
    from a state of which it is not known whether the tree can get there.
    """

    claim: Claim
    plan_length: int
    trace: Trace
    happens: bool


@dataclass(frozen=True)
class Proof:
    """What was found out about a tree: the claims that were looked at, and those that fail."""

    tree: TreeSpec
    claims: tuple[Claim, ...]
    refuted: tuple[Refutation, ...]

    @property
    def holds(self) -> bool:
        return not self.refuted


def prove(tree: TreeSpec, plan_lengths: Sequence[int] = PLAN_LENGTHS) -> Proof:
    """Prove every claim, or find ticks that break it.

    ``plan_lengths``: how many actions the plan slot holds; the default is enough for any number.

    Raises:
        NotReproduced: an example does not happen in py_trees: the programs are wrong, not the tree.
    """
    claims = claims_of(monitored=tree.metric is not None)
    lengths = plan_lengths if _has_slot(tree) else plan_lengths[:1]
    refuted: dict[str, Refutation] = {}
    for length in lengths:
        copies = [numbered(tree.root, length)]
        control = _program(copies, claims, "asp/tree_any_state.lp")
        # Claim by claim: asked about all at once, clingo takes ten times as long on long plans.
        for claim in claims:
            model = [] if claim.name in refuted else _broken(control, claim.name)
            if model:
                refuted[claim.name] = _example(tree, claim, claims, length) or Refutation(
                    claim, length, read_trace(copies, model, claim.name), happens=False
                )
    return Proof(tree, claims, tuple(refuted.values()))


def _has_slot(tree: TreeSpec) -> bool:
    return any(spec.kind == "plan_slot" for _, spec in tree.root.walk())


def _example(
    tree: TreeSpec, claim: Claim, claims: tuple[Claim, ...], plan_length: int
) -> Refutation | None:
    """The shortest run from the start that breaks ``claim``; None if it is not a short one.

    Raises:
        NotReproduced: py_trees does otherwise.
    """
    for ticks in range(1, LONGEST_EXAMPLE + 1):
        copies: list[Numbered] = []
        for _ in range(ticks):
            first = sum(1 for _ in copies[0].walk()) * len(copies) if copies else 0
            copies.append(numbered(tree.root, plan_length, first))
        control = _program(copies, claims, "asp/tree_run.lp")
        model = _broken(control, claim.name)
        if model:
            trace = read_trace(copies, model, claim.name)
            replay(trace)
            return Refutation(claim, plan_length, trace, happens=True)
    return None


def _broken(control: Control, what: str) -> list[Symbol]:
    """Atoms of a tick in which the claim called ``what`` is broken; empty if there is none."""
    asked = Function("asked", [Function(what)])
    atoms: list[Symbol] = []

    def keep(model: Model) -> None:
        atoms[:] = model.symbols(atoms=True)

    control.assign_external(asked, True)
    control.solve(on_model=keep)
    control.assign_external(asked, False)
    return atoms


def _program(copies: Sequence[Numbered], claims: tuple[Claim, ...], states: str) -> Control:
    """The tree, once for each tick in ``copies``, with claims about the last one.

    ``states`` is the program that says what may be before a tick.
    """
    control = Control(["--warn=none"])
    for file in ("asp/tree_semantics.lp", "asp/tree_proof.lp", states):
        control.load(str(resource(file)))
    facts = [*claim_facts(claims), f"examined({len(copies) - 1})."]
    for tick, root in enumerate(copies):
        facts += (*tree_facts(root), *leaf_facts(root), *guard_facts(root))
        facts += (f"at({node.number},{tick})." for node in root.walk())
        if tick == 0:
            facts += (f"starts({node.number})." for node in root.walk())
        else:
            pairs = zip(copies[tick - 1].walk(), root.walk(), strict=True)
            facts += (f"follows({before.number},{now.number})." for before, now in pairs)
    control.add("base", [], "\n".join(facts))
    control.ground([("base", [])])
    return control
