"""The kinds of decorators that a tree file may use, and what each shows for what its child shows.

The table of statuses is written once, here: the picture, the proof and the tests read it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal

from py_trees import decorators
from py_trees.behaviour import Behaviour
from py_trees.common import OneShotPolicy, Status
from pydantic import Field

from defras_bt.executive import quiet
from defras_bt.executive.node import NodeParameters, NoParameters
from defras_bt.executive.time_out import TimeOut

S, F, R = Status.SUCCESS, Status.FAILURE, Status.RUNNING


class RetryOptions(NodeParameters):
    """How often to try."""

    attempts: int = Field(ge=1, description="Number of failures after which it fails.")


class RepeatOptions(NodeParameters):
    """How often to repeat."""

    times: int = Field(ge=1, description="Number of successes after which it succeeds.")


class TimeOutOptions(NodeParameters):
    """How long to wait."""

    ticks: int = Field(ge=1, description="Ticks of world time after which it fails.")


class OnceOptions(NodeParameters):
    """When it is over for good."""

    until: Literal["success", "completion"] = Field(
        default="success", description="success: its child succeeded; completion: or failed."
    )


class WaitForOptions(NodeParameters):
    """What to wait for."""

    status: Literal["success", "failure"] = Field(description="The answer that is waited for.")


@dataclass(frozen=True)
class DecoratorKind:
    """A kind of decorator.

    ``shows`` gives its status for each of its child's. Where it counts, it shows RUNNING instead
    each time its child shows ``counts``, until it has done so as often as its option ``limit``
    says. ``build(name, options, child)`` makes the py_trees behaviour.
    """

    name: str
    description: str
    behaviour: type[Behaviour]
    build: Callable[[str, Any, Behaviour], Behaviour]
    shows: Mapping[Status, Status]
    options: type[NodeParameters] = NoParameters
    counts: Status | None = None
    limit: str = ""


def _plain(
    name: str,
    behaviour: type[decorators.Decorator],
    description: str,
    shows: Mapping[Status, Status],
) -> DecoratorKind:
    return DecoratorKind(
        name, description, behaviour, lambda name, _, child: behaviour(name, child), shows
    )


_ONCE = {
    "success": OneShotPolicy.ON_SUCCESSFUL_COMPLETION,
    "completion": OneShotPolicy.ON_COMPLETION,
}
_SAME = {S: S, F: F, R: R}

_KINDS = (
    _plain(
        "invert",
        quiet.Inverter,
        "Fails when its child succeeds and succeeds when it fails.",
        {S: F, F: S, R: R},
    ),
    _plain(
        "ignore_failure",
        quiet.FailureIsSuccess,
        "Succeeds also when its child fails.",
        {S: S, F: S, R: R},
    ),
    _plain(
        "success_is_failure",
        decorators.SuccessIsFailure,
        "Fails also when its child succeeds.",
        {S: F, F: F, R: R},
    ),
    _plain(
        "success_is_running",
        decorators.SuccessIsRunning,
        "Goes on running when its child succeeds, and starts it again.",
        {S: R, F: F, R: R},
    ),
    _plain(
        "failure_is_running",
        decorators.FailureIsRunning,
        "Goes on running when its child fails, and starts it again.",
        {S: S, F: R, R: R},
    ),
    _plain(
        "running_is_failure",
        decorators.RunningIsFailure,
        "Fails, and stops its child, if that does not answer at once.",
        {S: S, F: F, R: F},
    ),
    _plain(
        "running_is_success",
        decorators.RunningIsSuccess,
        "Succeeds, and stops its child, if that does not answer at once.",
        {S: S, F: F, R: S},
    ),
    DecoratorKind(
        "retry",
        "Starts its child again when it fails, up to a number of attempts.",
        decorators.Retry,
        lambda name, o, child: decorators.Retry(name, child, num_failures=o.attempts),
        _SAME,
        RetryOptions,
        counts=F,
        limit="attempts",
    ),
    DecoratorKind(
        "repeat",
        "Starts its child again when it succeeds, a number of times; fails when it fails.",
        decorators.Repeat,
        lambda name, o, child: decorators.Repeat(name, child, num_success=o.times),
        _SAME,
        RepeatOptions,
        counts=S,
        limit="times",
    ),
    DecoratorKind(
        "time_out",
        "Fails, and stops its child, when that has run for a number of ticks of world time.",
        TimeOut,
        lambda name, o, child: TimeOut(name, child, o.ticks),
        {S: S, F: F, R: F},
        TimeOutOptions,
        counts=R,
        limit="ticks",
    ),
    DecoratorKind(
        "once",
        "Carries its child out to its end once, and from then on gives that answer without asking "
        "again. No place for a guard of motion.",
        decorators.OneShot,
        lambda name, o, child: decorators.OneShot(name, child, _ONCE[o.until]),
        _SAME,
        OnceOptions,
    ),
    DecoratorKind(
        "wait_for",
        "Succeeds when its child gives the answer that is waited for; runs until then.",
        decorators.Condition,
        lambda name, o, child: decorators.Condition(name, child, Status[o.status.upper()]),
        {S: R, F: R, R: R},
        WaitForOptions,
    ),
)

DECORATORS: Mapping[str, DecoratorKind] = MappingProxyType({kind.name: kind for kind in _KINDS})
"""Every decorator by name, in the order in which documentation lists them."""


def decorator_shows(kind: DecoratorKind, options: Any) -> Mapping[Status, Status]:
    """What this decorator shows for each status of its child, its options considered."""
    if isinstance(options, WaitForOptions):
        return {**kind.shows, Status[options.status.upper()]: S}
    return kind.shows
