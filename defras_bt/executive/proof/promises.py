"""What leaves promise about their answers, so that the proof may count on it.

Without a promise a leaf may answer anything in any tick. Each promise made here is kept against the
leaf itself by a test.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from py_trees.common import Status

from defras_bt.executive.proof.claims import WORLD
from defras_bt.executive.proof.facts import LETTERS, Numbered
from defras_bt.executive.tree_spec import NodeSpec

S, F, R = Status.SUCCESS, Status.FAILURE, Status.RUNNING

Promise = Callable[[Any, str], Status | None]
"""Answer of a leaf with these parameters where a variable of the world has this value."""

LONGEST_PATIENCE_S = 1.0
"""From then on a force over its threshold is dangerous, and no guard may be patient any more."""


def _below(parameters: Any, warning: str) -> Status | None:
    return S if warning != "unknown" and int(warning) < parameters.state else F


def _reached(parameters: Any, warning: str) -> Status | None:
    return S if warning != "unknown" and int(warning) >= parameters.state else F


def _force(parameters: Any, force: str) -> Status | None:
    impatient = parameters.patience_s <= LONGEST_PATIENCE_S
    return F if force == "dangerous" and impatient else None


PROMISES: Mapping[tuple[str, str], Promise] = {
    ("SensorsFresh", "readings"): lambda _, value: S if value == "fresh" else F,
    ("OperatorPermits", "operator"): lambda _, value: F if value == "stops" else None,
    ("ForceAccepted", "force"): _force,
    ("WarningBelow", "warning"): _below,
    ("WarningReached", "warning"): _reached,
}
"""By class and variable of the world. None: the leaf may answer anything."""

ALWAYS: Mapping[str, frozenset[Status]] = {"AskHuman": frozenset({S})}
"""All that leaves of a class ever answer; those not named here may answer anything."""

COMMANDING = frozenset({"LetGo"})
"""Classes that command an arm without moving it: their role is not motion, but they open a jaw."""


def may_answer(spec: NodeSpec | None) -> frozenset[Status]:
    """What a leaf may answer at all; ``spec`` is None for an action of a plan."""
    anything = frozenset({S, F, R})
    return anything if spec is None else ALWAYS.get(spec.kind, anything)


def commands(node: Numbered) -> bool:
    """Whether a leaf may propose any command, opening a jaw included."""
    return node.moves or (node.spec is not None and node.spec.kind in COMMANDING)


def leaf_facts(root: Numbered) -> Iterator[str]:
    """What asp/tree_proof.lp asks for about the leaves."""
    for node in root.walk():
        if not node.is_leaf:
            continue
        yield from (f"may({node.number},{LETTERS[s]})." for s in may_answer(node.spec))
        if node.moves:
            yield f"moves({node.number})."
        if commands(node):
            yield f"commands({node.number})."
        if node.spec is not None:
            yield from _promise_facts(node.number, node.spec)


def _promise_facts(number: int, spec: NodeSpec) -> Iterator[str]:
    for variable, values in WORLD.items():
        promise = PROMISES.get((spec.kind, variable))
        for value in values if promise is not None else ():
            status = promise(spec.options, value) if promise is not None else None
            if status is not None:
                yield f'promises({number},{variable},"{value}",{LETTERS[status]}).'
