"""The kinds of inner nodes that a tree file may use, and what each becomes in py_trees.

Whether a guard is safe depends on the kind above it, so the kinds are named by what they do rather
than by a memory flag: under ``reactive`` every child is ticked again every tick, and a child that
stops succeeding pre-empts those after it in the same tick; under ``sequence`` a finished child is
not looked at again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal

from py_trees import composites, decorators
from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy
from pydantic import Field

from defras_bt.executive.composites import PlanSlot
from defras_bt.executive.node import NodeParameters, NoParameters


class ParallelOptions(NodeParameters):
    """When a parallel succeeds; it fails as soon as one child fails."""

    succeed_when: Literal["all", "one"] = Field(
        description="all: every child succeeds in the same tick; one: at least one does."
    )


class RetryOptions(NodeParameters):
    """How often to try."""

    attempts: int = Field(ge=1, description="Number of failures after which it fails.")


class RepeatOptions(NodeParameters):
    """How often to repeat."""

    times: int = Field(ge=1, description="Number of successes after which it succeeds.")


@dataclass(frozen=True)
class Kind:
    """A kind of inner node. ``holds``: the key under which its children stand, None for none.

    ``build(name, options, children)`` makes the py_trees behaviour.
    """

    name: str
    holds: Literal["children", "child"] | None
    description: str
    build: Callable[[str, Any, list[Behaviour]], Behaviour]
    options: type[NodeParameters] = NoParameters


def _parallel(name: str, options: ParallelOptions, children: list[Behaviour]) -> Behaviour:
    # A synchronised policy would skip a guard that succeeded once, so it is not offered.
    policy: ParallelPolicy.Base
    if options.succeed_when == "all":
        policy = ParallelPolicy.SuccessOnAll(synchronise=False)
    else:
        policy = ParallelPolicy.SuccessOnOne()
    return composites.Parallel(name, policy, children)


_KINDS = (
    Kind(
        "reactive",
        "children",
        "Every tick, ticks its children in order from the first until one does not succeed; that "
        "one pre-empts those after it. The place for guards: they come before what they guard.",
        lambda name, _, children: composites.Sequence(name, memory=False, children=children),
    ),
    Kind(
        "sequence",
        "children",
        "Carries out its children one after the other; a finished child is not looked at again.",
        lambda name, _, children: composites.Sequence(name, memory=True, children=children),
    ),
    Kind(
        "reactive_selector",
        "children",
        "Every tick, tries its children in order from the first until one does not fail; that one "
        "pre-empts those after it.",
        lambda name, _, children: composites.Selector(name, memory=False, children=children),
    ),
    Kind(
        "selector",
        "children",
        "Tries its children in order until one succeeds; a running child is kept until it ends.",
        lambda name, _, children: composites.Selector(name, memory=True, children=children),
    ),
    Kind(
        "parallel",
        "children",
        "Ticks all its children every tick and fails when one fails. No place for a guard of "
        "motion: the children beside it are still ticked once when it trips.",
        _parallel,
        ParallelOptions,
    ),
    Kind(
        "invert",
        "child",
        "Fails when its child succeeds and succeeds when it fails.",
        lambda name, _, children: decorators.Inverter(name, children[0]),
    ),
    Kind(
        "ignore_failure",
        "child",
        "Succeeds also when its child fails.",
        lambda name, _, children: decorators.FailureIsSuccess(name, children[0]),
    ),
    Kind(
        "retry",
        "child",
        "Starts its child again when it fails, up to a number of attempts.",
        lambda name, o, children: decorators.Retry(name, children[0], num_failures=o.attempts),
        RetryOptions,
    ),
    Kind(
        "repeat",
        "child",
        "Starts its child again when it succeeds, a number of times; fails when it fails.",
        lambda name, o, children: decorators.Repeat(name, children[0], num_success=o.times),
        RepeatOptions,
    ),
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
        case decorators.Inverter():
            return "invert"
        case decorators.FailureIsSuccess():
            return "ignore_failure"
        case decorators.Retry():
            return "retry"
        case decorators.Repeat():
            return "repeat"
    return type(behaviour).__name__
