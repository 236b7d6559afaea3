"""What Ctrl-C, and a system that shuts down, mean while operating."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_REASONS = {
    signal.SIGINT: "the operator asked to stop",
    signal.SIGTERM: "the system asked to stop",
    signal.SIGHUP: "the terminal was closed",
}
_FINISHING = "\nThe arms are still. The recordings are being finished; please wait.\n"


class Interrupts:
    """Ctrl-C asks the executive to stop and hold; a second one ends the run at once.

    Either way the recordings are finished, and that nothing interrupts: it takes seconds, and what
    it leaves is what the run was recorded for. SIGTERM and SIGHUP count like Ctrl-C; one that was
    ignored when the program started (as under nohup) stays so.
    """

    def __init__(self) -> None:
        self._asked: str | None = None
        self._ended = False

    def operator_stop(self) -> str | None:
        """Why to stop; None while nobody asked."""
        return self._asked

    @contextmanager
    def heeded(self) -> Iterator[Interrupts]:
        """While operating: whoever interrupts is heard by the executive."""
        before = {
            number: signal.signal(number, self._on_interrupt)
            for number in _REASONS
            if signal.getsignal(number) is not signal.SIG_IGN
        }
        try:
            yield self
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    @contextmanager
    def finishing(self) -> Iterator[None]:
        """While recordings are finished: whoever interrupts is asked to wait."""
        self._ended = True
        yield

    def _on_interrupt(self, number: int, _: FrameType | None) -> None:
        if self._ended:
            # Printing could fall into the middle of a print that was interrupted.
            os.write(sys.__stderr__.fileno() if sys.__stderr__ else 2, _FINISHING.encode())
        elif self._asked is None:
            self._asked = _REASONS[signal.Signals(number)]
        else:
            self._ended = True
            raise KeyboardInterrupt
