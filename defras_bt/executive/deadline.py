"""Ends a tree that never returns.

A leaf that hangs moves nothing: a command ends with its tick, and silence is a hold. But the
executive knows only world time, and that stands still or runs on unseen meanwhile: no guard, no
operator and no record would come to their turn any more. Whoever starts an operation therefore
decides how long a tick may take on the wall, and hands the executive something that interrupts it.
"""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from types import FrameType

from defras_bt.executive.node import Node

Deadline = Callable[[], AbstractContextManager[None]]
"""Called once per tick; what it returns surrounds the ticking of the tree."""

LONGEST_TICK_S = 5.0
"""A tick of the shipped trees takes milliseconds, on a busy machine some tens of them."""
LONGEST_RECOVERY_S = 600.0
"""Learning and rehearsing may take minutes where nothing is compiled yet and processors are few."""
# A leaf that swallows every exception is interrupted again and again.
_AGAIN_S = 1.0


class TreeStuck(RuntimeError):
    """The tree did not return."""


def interrupting(limit_s: float = LONGEST_TICK_S, recovery_s: float = 0.0) -> Deadline:
    """A deadline that raises :class:`TreeStuck` in a tree that took ``limit_s`` seconds.

    A leaf of role "recovery", which nothing moves under, has ``recovery_s`` where that is longer.
    It uses the process's alarm, and so works in the main thread of a POSIX system only. Python code
    is interrupted where it stands; a call into a library when it returns.

    Raises:
        ValueError: ``limit_s`` is not positive.
    """
    if not limit_s > 0.0:
        raise ValueError(f"a tick needs a positive limit, not {limit_s} s")

    @contextmanager
    def deadline() -> Iterator[None]:
        late_s = limit_s

        def ring(_: int, frame: FrameType | None) -> None:
            nonlocal late_s
            leaf = _ticked(frame)
            allowed_s = limit_s
            if leaf is not None and leaf.role == "recovery":
                allowed_s = max(limit_s, recovery_s)
            if late_s >= allowed_s:
                who = "the tree" if leaf is None else f"{type(leaf).__name__} {leaf.name!r}"
                raise TreeStuck(f"{who} did not return within {allowed_s:g} s")
            late_s += _AGAIN_S

        before = signal.signal(signal.SIGALRM, ring)
        signal.setitimer(signal.ITIMER_REAL, limit_s, _AGAIN_S)
        try:
            yield
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, before)

    return deadline


def _ticked(frame: FrameType | None) -> Node | None:
    """The leaf whose turn it is: the stack knows, and so nobody has to note it in every tick."""
    while frame is not None:
        if frame.f_code is Node.tick.__code__:
            leaf: Node = frame.f_locals["self"]
            return leaf
        frame = frame.f_back
    return None
