"""Which guards stand above which motion, as formulas for asp/tree_proof.lp.

What a guard is meant to guard is read off the tree without regard to how its composites work: a
condition that stands before a motion under a composite that carries its children out together
(``reactive``, ``sequence``, ``parallel``) is meant to hold while that motion is carried out.
Whether the composites see to it is what is proved.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from py_trees.common import Status

from defras_bt.executive.proof.facts import LETTERS, Numbered
from defras_bt.executive.tree_decorators import DECORATORS, decorator_shows
from defras_bt.executive.tree_kinds import ParallelOptions

_TOGETHER = ("reactive", "sequence", "parallel")


@dataclass(frozen=True)
class Condition:
    """What guards should have answered in a tick.

    A literal names a leaf (``node``) and its answer; "every" and "some" join ``parts``.
    """

    kind: Literal["literal", "every", "some"]
    node: int = -1
    answer: Status = Status.SUCCESS
    parts: tuple[Condition, ...] = ()


def condition(node: Numbered, wanted: Status = Status.SUCCESS) -> Condition | None:
    """What the guards at and under ``node`` should answer for it to be ``wanted``.

    None where no guard decides: another leaf does, or a branch without one may succeed as well. A
    decorator that passes a failed guard on as a success changes nothing about what is meant, unless
    it stands over something that acts by itself, such as learning on the way.
    """
    spec = node.spec
    if spec is None or spec.node_class is not None:
        is_guard = (
            spec is not None and spec.node_class is not None and spec.node_class.role == "guard"
        )
        return Condition("literal", node.number, wanted) if is_guard else None
    if spec.kind == "invert":
        opposite = Status.FAILURE if wanted == Status.SUCCESS else Status.SUCCESS
        return condition(node.children[0], opposite) if only_guards(node) else None
    if spec.kind in DECORATORS:
        shows = decorator_shows(DECORATORS[spec.kind], spec.options)
        passes_on = (
            shows[Status.FAILURE] == Status.FAILURE and shows[Status.RUNNING] != Status.SUCCESS
        )
        return condition(node.children[0], wanted) if passes_on or only_guards(node) else None
    if isinstance(spec.options, ParallelOptions) and isinstance(spec.options.succeed_when, tuple):
        needed = [
            c for c in node.children if c.path.rpartition("/")[2] in spec.options.succeed_when
        ]
    else:
        needed = list(node.children)
    any_is_enough = spec.kind in ("selector", "reactive_selector") or (
        isinstance(spec.options, ParallelOptions) and spec.options.succeed_when == "one"
    )
    parts = tuple(condition(child, wanted) for child in needed)
    return _joined(parts, any_is_enough == (wanted == Status.SUCCESS))


def _joined(parts: tuple[Condition | None, ...], any_is_enough: bool) -> Condition | None:
    known = tuple(part for part in parts if part is not None)
    if not known or (any_is_enough and len(known) < len(parts)):
        return None
    if len(known) == 1:
        return known[0]
    return Condition("some" if any_is_enough else "every", parts=known)


def only_guards(node: Numbered) -> bool:
    """Whether every leaf at and under ``node`` is a guard: then all it does is to ask."""
    if node.is_leaf:
        return condition(node) is not None
    return bool(node.children) and all(map(only_guards, node.children))


def demands_success(wanted: Condition) -> bool:
    """Whether a condition can only hold where some guard succeeded.

    One that holds where a guard failed, as under ``invert``, lets motion pass on missing data.
    """
    if wanted.kind == "literal":
        return wanted.answer == Status.SUCCESS
    found = map(demands_success, wanted.parts)
    return all(found) if wanted.kind == "some" else any(found)


def guarding(node: Numbered, index: int) -> Iterator[tuple[int, Condition]]:
    """Conditions that children of ``node`` set for its child ``index``, with the index of each."""
    if node.spec is None or node.spec.kind not in _TOGETHER:
        return
    for other, child in enumerate(node.children):
        if other < index or (node.spec.kind == "parallel" and other != index):
            wanted = condition(child)
            if wanted is not None:
                yield other, wanted


def guard_facts(root: Numbered) -> Iterator[str]:
    """``guarded_by`` with the formulas it names, and ``unguarded``."""
    yield from _facts(root, guarded=False)


def _facts(node: Numbered, guarded: bool) -> Iterator[str]:
    if node.moves and not guarded:
        yield f"unguarded({node.number})."
    for index, child in enumerate(node.children):
        if not any(under.moves or under.is_slot for under in child.walk()):
            continue
        here = guarded
        for other, wanted in guarding(node, index):
            formula = f"at({node.number},{other + 1})"
            yield f"guarded_by({child.number},{formula})."
            yield from _formula(formula, wanted)
            here = here or demands_success(wanted)
        yield from _facts(child, here)


def _formula(name: str, wanted: Condition) -> Iterator[str]:
    if wanted.kind == "literal":
        yield f"literal({name},{wanted.node},{LETTERS[wanted.answer]})."
    for index, part in enumerate(wanted.parts):
        inner = f"part({name},{index})"
        yield f"{wanted.kind}({name},{inner})."
        yield from _formula(inner, part)
