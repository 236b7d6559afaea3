"""The kinds of inner nodes that a tree file may use, and what each becomes in py_trees.

Whether a guard is safe depends on the kind above it, so the kinds are named by what they do rather
than by a memory flag: under ``reactive`` every child is ticked again every tick, and a child that
stops succeeding pre-empts those after it in the same tick; under ``sequence`` a finished child is
not looked at again.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, Any, Literal

from py_trees import composites
from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy
from pydantic import Field

from defras_bt.executive import quiet
from defras_bt.executive.composites import PlanSlot
from defras_bt.executive.node import NodeParameters, NoParameters
from defras_bt.executive.registry import did_you_mean
from defras_bt.executive.tree_decorators import DECORATORS, DecoratorKind


class ParallelOptions(NodeParameters):
    """When a parallel succeeds; it fails as soon as one child fails."""

    succeed_when: Literal["all", "one"] | Annotated[tuple[str, ...], Field(min_length=1)] = Field(
        description="all: every child succeeds; one: at least one does; a list of names: these do."
    )
    synchronise: bool = Field(
        default=False,
        description="Whether a child that succeeded is not asked again until all have. Never do "
        "this to a guard.",
    )


@dataclass(frozen=True)
class Kind:
    """A kind of inner node. ``holds``: the key under which its children stand, None for none.

    ``build(name, options, children)`` makes the py_trees behaviour. ``objection(options, names)``
    says in words why the options do not suit children of these names; None if they do.
    """

    name: str
    holds: Literal["children", "child"] | None
    description: str
    build: Callable[[str, Any, list[Behaviour]], Behaviour]
    options: type[NodeParameters] = NoParameters
    objection: Callable[[Any, Collection[str]], str | None] = lambda _options, _names: None


def _parallel(name: str, options: ParallelOptions, children: list[Behaviour]) -> Behaviour:
    policy: ParallelPolicy.Base
    if options.succeed_when == "all":
        policy = ParallelPolicy.SuccessOnAll(synchronise=options.synchronise)
    elif options.succeed_when == "one":
        policy = ParallelPolicy.SuccessOnOne()
    else:
        selected = [child for child in children if child.name in options.succeed_when]
        policy = ParallelPolicy.SuccessOnSelected(selected, synchronise=options.synchronise)
    return composites.Parallel(name, policy, children)


def _parallel_objection(options: ParallelOptions, names: Collection[str]) -> str | None:
    if options.succeed_when == "one":
        return (
            "parallel.synchronise has no meaning with succeed_when: one"
            if options.synchronise
            else None
        )
    if options.succeed_when == "all":
        return None
    strange = next((name for name in options.succeed_when if name not in names), None)
    if strange is None:
        return None
    return f"parallel.succeed_when: no child is called {strange!r}{did_you_mean(strange, names)}"


def _decorating(kind: DecoratorKind) -> Kind:
    return Kind(
        kind.name,
        "child",
        kind.description,
        lambda name, options, children: kind.build(name, options, children[0]),
        kind.options,
    )


_KINDS = (
    Kind(
        "reactive",
        "children",
        "Every tick, ticks its children in order from the first until one does not succeed; that "
        "one pre-empts those after it. The place for guards: they come before what they guard.",
        lambda name, _, children: quiet.Sequence(name, memory=False, children=children),
    ),
    Kind(
        "sequence",
        "children",
        "Carries out its children one after the other; a finished child is not looked at again.",
        lambda name, _, children: quiet.Sequence(name, memory=True, children=children),
    ),
    Kind(
        "reactive_selector",
        "children",
        "Every tick, tries its children in order from the first until one does not fail; that one "
        "pre-empts those after it.",
        lambda name, _, children: quiet.Selector(name, memory=False, children=children),
    ),
    Kind(
        "selector",
        "children",
        "Tries its children in order until one succeeds; a running child is kept until it ends.",
        lambda name, _, children: quiet.Selector(name, memory=True, children=children),
    ),
    Kind(
        "parallel",
        "children",
        "Ticks all its children every tick and fails when one fails. No place for a guard of "
        "motion: the children beside it are still ticked once when it trips.",
        _parallel,
        ParallelOptions,
        _parallel_objection,
    ),
    *map(_decorating, DECORATORS.values()),
    Kind(
        "plan_slot",
        None,
        "The place where the actions of a plan are carried out; fails while there is no plan.",
        lambda name, _options, _children: PlanSlot(name),
    ),
)

KINDS: Mapping[str, Kind] = MappingProxyType({kind.name: kind for kind in _KINDS})
"""Every kind by name, in the order in which documentation lists them."""


def kind_of(behaviour: Behaviour) -> str:
    """The name under which a tree file would write ``behaviour``: its kind or its class.

    >>> kind_of(composites.Sequence("look", memory=False))
    'reactive'
    """
    match behaviour:
        case PlanSlot():
            return "plan_slot"
        case composites.Sequence():
            return "sequence" if behaviour.memory else "reactive"
        case composites.Selector():
            return "selector" if behaviour.memory else "reactive_selector"
        case composites.Parallel():
            return "parallel"
    by_class = {kind.behaviour: kind.name for kind in DECORATORS.values()}
    return by_class.get(type(behaviour), type(behaviour).__name__)
