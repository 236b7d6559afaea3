"""What Ctrl-C, and a system that shuts down, mean while operating."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from defras_bt.executive.operator_desk import OperatorDesk
from defras_bt.recording.operator_state import Act

_SOURCES = {
    signal.SIGINT: ("Ctrl-C", ""),
    signal.SIGTERM: ("system", "the system asked to stop"),
    signal.SIGHUP: ("terminal", "the terminal was closed"),
}
_FINISHING = "\nThe arms are still. The recordings are being finished; please wait.\n"


class Interrupts:
    """Ctrl-C asks the executive to stop and hold; a second one ends the run at once.

    Either way the recordings are finished, and that nothing interrupts: it takes seconds, and what
    it leaves is what the run was recorded for. SIGTERM and SIGHUP count like Ctrl-C; one that was
    ignored when the program started (as under nohup) stays so.

    ``last_deed``: nothing but the program's end comes afterwards, so that whoever goes on pressing
    Ctrl-C need not be heard any more.
    """

    def __init__(self, desk: OperatorDesk, *, last_deed: bool = False) -> None:
        self._desk = desk
        self._last_deed = last_deed
        self._asked = False
        self._ended = False

    @contextmanager
    def heeded(self) -> Iterator[Interrupts]:
        """While operating: whoever interrupts is heard by the executive."""
        before = {
            number: signal.signal(number, self._on_interrupt)
            for number in _SOURCES
            if signal.getsignal(number) is not signal.SIG_IGN
        }
        try:
            yield self
        finally:
            deaf = self._last_deed and self._asked
            for number, handler in before.items():
                signal.signal(number, signal.SIG_IGN if deaf else handler)

    @contextmanager
    def finishing(self) -> Iterator[None]:
        """While recordings are finished: whoever interrupts is asked to wait."""
        self._ended = True
        yield

    def _on_interrupt(self, number: int, _: FrameType | None) -> None:
        if self._ended:
            # Printing could fall into the middle of a print that was interrupted.
            os.write(sys.__stderr__.fileno() if sys.__stderr__ else 2, _FINISHING.encode())
        elif not self._asked:
            self._asked = True
            source, words = _SOURCES[signal.Signals(number)]
            self._desk.request(Act.STOP, source, words)
        else:
            self._ended = True
            raise KeyboardInterrupt
