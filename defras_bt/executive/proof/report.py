"""What was proved about a tree, for people."""

from __future__ import annotations

from collections.abc import Iterator

from py_trees.common import Status

from defras_bt.executive.dangers import WORLD
from defras_bt.executive.proof.blame import blame
from defras_bt.executive.proof.facts import Numbered
from defras_bt.executive.proof.prover import Proof, Refutation
from defras_bt.executive.proof.trace import Trace, TracedTick

_WORDS = {
    Status.INVALID: "-",
    Status.RUNNING: "running",
    Status.SUCCESS: "success",
    Status.FAILURE: "failure",
}


def proof_text(proof: Proof) -> str:
    """Every claim, proved or refuted; of those refuted the node at fault and the ticks."""
    refuted = {refutation.claim.name: refutation for refutation in proof.refuted}
    lines = []
    for claim in proof.claims:
        lines.append(f"{'✗' if claim.name in refuted else '✓'} {claim.name}: {claim.statement}")
    for refutation in proof.refuted:
        lines += ["", *_refutation_lines(refutation)]
    return "\n".join(lines)


def _refutation_lines(refutation: Refutation) -> Iterator[str]:
    trace, claim = refutation.trace, refutation.claim
    found = blame(trace, claim)
    yield f"✗ {claim.name} does not hold: {', '.join(trace.culprits)}"
    yield f"  at fault: {found.node.path}{_where(found.node)}: {found.sentence}"
    if refutation.happens:
        count = len(trace.ticks)
        yield (
            f"  {'This tick breaks' if count == 1 else f'These {count} ticks break'} it, from the "
            f"start of an operation{_with_plan(refutation)}; py_trees does the same:"
        )
    else:
        yield (
            "  It is not proved: this tick would break it. Whether the tree can get into the state "
            "before it is not known; no run of a few ticks does."
        )
    for number, tick in enumerate(trace.ticks, 1):
        yield f"  tick {number}: {_world(tick)}"
        yield from (f"    {line}" for line in _table(trace, tick))


def _where(node: Numbered) -> str:
    """Kind and place, as far as the node stands in a file."""
    if node.spec is None:
        return " (an action of the plan)"
    file, line, column = node.spec.place
    return f" ({node.spec.kind}, {file}:{line}:{column})"


def _with_plan(refutation: Refutation) -> str:
    if refutation.plan_length == 0:
        return ""
    return f" with a plan of {refutation.plan_length} action(s)"


def _world(tick: TracedTick) -> str:
    known = ", ".join(f"{variable} {tick.world[variable]}" for variable in WORLD)
    return f"a new plan is put in; {known}" if tick.new_plan else known


def _table(trace: Trace, tick: TracedTick) -> list[str]:
    """The way to the first culprit, and what was asked beside it."""
    rows = [("node", "before", "shows", "after")]
    for node, depth in _worth_showing(trace.root, trace.culprits[0], tick):
        shown = tick.shown.get(node.path)
        rows.append(
            (
                "  " * depth + node.path.rpartition("/")[2],
                _WORDS[tick.before[node.path]],
                "not ticked" if shown is None else _WORDS[shown],
                _WORDS[tick.after[node.path]],
            )
        )
    widths = [max(len(row[column]) for row in rows) for column in range(4)]
    return [
        "  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]


def _worth_showing(
    node: Numbered, culprit: str, tick: TracedTick, depth: int = 0
) -> Iterator[tuple[Numbered, int]]:
    yield node, depth
    on_the_way = f"{culprit}/".startswith(f"{node.path}/")
    for child in node.children:
        acts = child.path in tick.shown or tick.before[child.path] != Status.INVALID
        leads_on = f"{culprit}/".startswith(f"{child.path}/")
        if leads_on or (acts and (on_the_way or (not node.is_slot and len(node.children) == 1))):
            yield from _worth_showing(child, culprit, tick, depth + 1)
