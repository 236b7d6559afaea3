"""Ends a tree that never returns.

The executive knows only world time, and that stands still or runs on unseen while a leaf is caught
in a loop. Whoever starts an operation therefore decides how long a tick may take on the wall, and
hands the executive something that interrupts it.
"""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

Deadline = Callable[[], AbstractContextManager[None]]
"""Called once per tick; what it returns surrounds the ticking of the tree."""

# A leaf that swallows every exception is interrupted again and again.
_AGAIN_S = 1.0


class TreeStuck(RuntimeError):
    """The tree did not return."""


def interrupting(limit_s: float) -> Deadline:
    """A deadline that raises :class:`TreeStuck` in a tree that took ``limit_s`` seconds.

    It uses the process's alarm, and so works in the main thread of a POSIX system only. Python code
    is interrupted where it stands; a call into a library when it returns.

    Raises:
        ValueError: ``limit_s`` is not positive.
    """
    if not limit_s > 0.0:
        raise ValueError(f"a tick needs a positive limit, not {limit_s} s")

    def ring(*_: object) -> None:
        raise TreeStuck(f"the tree did not return within {limit_s:g} s")

    @contextmanager
    def deadline() -> Iterator[None]:
        before = signal.signal(signal.SIGALRM, ring)
        signal.setitimer(signal.ITIMER_REAL, limit_s, _AGAIN_S)
        try:
            yield
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, before)

    return deadline
