"""Which node is at fault when a claim about a tree does not hold."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

from py_trees.common import Status

from defras_bt.executive.proof.claims import Claim
from defras_bt.executive.proof.facts import Numbered
from defras_bt.executive.proof.guards import Condition, condition, guarding
from defras_bt.executive.proof.promises import promise
from defras_bt.executive.proof.trace import Trace, TracedTick
from defras_bt.executive.tree_decorators import DECORATORS


@dataclass(frozen=True)
class Blame:
    """The node at fault, and what it does, as a sentence about "it"."""

    node: Numbered
    sentence: str


def blame(trace: Trace, claim: Claim) -> Blame:
    """The node that lets the first culprit of the last tick act.

    In this order: whoever carries on without a guard or lets a failed one pass as a success;
    whoever leaves a motion running that it did not tick; whoever does not ask a leaf that knows
    about the danger; whoever hides that such a leaf took over; else the composite that asks no such
    leaf.
    """
    tick = trace.ticks[-1]
    way = list(_way(trace.root, trace.culprits[0]))
    found = _unmet(way, tick) or _left_running(way, tick) or _unheard(trace.root, way, tick, claim)
    return found or _unguarded(way, claim)


def _way(root: Numbered, path: str) -> Iterator[Numbered]:
    """The nodes from the root down to ``path``."""
    yield root
    while root.path != path:
        root = next(c for c in root.children if f"{path}/".startswith(f"{c.path}/"))
        yield root


def _holds(wanted: Condition, numbers: dict[int, Status]) -> bool:
    if wanted.kind == "literal":
        return numbers.get(wanted.node) == wanted.answer
    parts = (_holds(part, numbers) for part in wanted.parts)
    return any(parts) if wanted.kind == "some" else all(parts)


def _unmet(way: list[Numbered], tick: TracedTick) -> Blame | None:
    """The first guard on the way that did not answer as it should, and who ignores it."""
    numbers = {n.number: tick.shown[n.path] for n in way[0].walk() if n.path in tick.shown}
    for node, child in pairwise(way):
        for other, wanted in guarding(node, node.children.index(child)):
            branch = node.children[other]
            if _holds(wanted, numbers):
                continue
            shown = tick.shown.get(branch.path)
            if shown is None:
                return Blame(node, f"it does not look at {branch.path} in this tick")
            if shown != Status.SUCCESS or child.path not in tick.shown:
                return Blame(node, f"it goes on although {branch.path} shows {shown.name}")
            return _liar(branch, tick, numbers)
    return None


def _liar(branch: Numbered, tick: TracedTick, numbers: dict[int, Status]) -> Blame:
    """The deepest node that shows SUCCESS although the guards under it do not allow that."""
    for child in branch.children:
        wanted = condition(child)
        if wanted is None or _holds(wanted, numbers):
            continue
        shown = tick.shown.get(child.path)
        if shown == Status.SUCCESS and child.children:
            return _liar(child, tick, numbers)
        answer = "was not asked in this tick" if shown is None else f"shows {shown.name}"
        return Blame(branch, f"it shows SUCCESS although {child.path} {answer}")
    return Blame(branch, "it shows SUCCESS although its guards do not permit it")


def _left_running(way: list[Numbered], tick: TracedTick) -> Blame | None:
    """The node that was ticked, did not tick the branch of a running motion, and did not end it."""
    culprit = way[-1]
    if culprit.path in tick.shown:
        return None
    node = next((n for n, child in pairwise(way) if child.path not in tick.shown), way[0])
    return Blame(node, f"it leaves {culprit.path} running in a tick in which it does not tick it")


def _unheard(root: Numbered, way: list[Numbered], tick: TracedTick, claim: Claim) -> Blame | None:
    """Who stands between a culprit and the leaves that know about the danger."""
    if claim.danger is None:
        return None
    for knowing in root.walk():
        if not _knows(knowing, claim) or knowing in way:
            continue
        other = list(_way(root, knowing.path))
        depth = next(i for i, (a, b) in enumerate(zip(way, other, strict=False)) if a != b)
        fork, branch = way[depth - 1], other[depth]
        if branch.number > way[depth].number:
            continue
        if branch.path not in tick.shown:
            return Blame(fork, f"it does not look at {branch.path} in this tick")
        for node, child in pairwise(other[depth:]):
            turned = tick.shown.get(node.path), tick.shown.get(child.path)
            kind = "" if node.spec is None else node.spec.kind
            if (
                kind in DECORATORS
                and kind != "invert"
                and turned == (Status.FAILURE, Status.SUCCESS)
            ):
                return Blame(node, f"it hides that {child.path} succeeded")
    return None


def _knows(node: Numbered, claim: Claim) -> bool:
    """Whether a leaf answers something definite in the danger of ``claim``."""
    return claim.danger is not None and promise(node, *claim.danger) is not None


def _unguarded(way: list[Numbered], claim: Claim) -> Blame:
    together = ("reactive", "sequence", "parallel")
    above = [n for n in way[:-1] if n.spec is not None and n.spec.kind in together]
    node = above[-1] if above else way[-1]
    if claim.danger is None:
        return Blame(node, "no guard stands before what moves there")
    variable, value = claim.danger
    return Blame(
        node,
        f"no guard before {way[-1].path} asks about this ({variable} {value}) so that it would "
        "stop it",
    )
