"""The stream of set-points in a process of its own.

The twin computes for tens of milliseconds in the executive's process, and Python lets one thread
run at a time: a stream beside it would stumble. It also goes on holding when the executive hangs,
and ends when the executive is gone.
"""

from __future__ import annotations

import subprocess
import sys
from multiprocessing import Pipe
from pathlib import Path
from threading import Lock
from time import monotonic
from typing import Any

from defras_bt.dvrk.settings import Setup
from defras_bt.dvrk.streaming.servo_loop import Snapshot, StreamReport, Tick
from defras_bt.dvrk.streaming.servo_requests import Answer, Begin, Begun, Question, Request
from defras_bt.dvrk.transport.transport import ConnectionFailed

_BEGIN_S = 20.0
_ANSWER_S = 1.0
_END_S = 5.0
_PROGRAM = "defras_bt.dvrk.streaming.servo_main"


class ServoLost(RuntimeError):
    """The process that streams set-points does not answer; the arms hold where they are."""


class ServoProcess:
    """As :class:`ServoLoop`, in a process of its own. Any thread may command; one asks."""

    def __init__(self, setup: Setup, log_file: Path | None = None) -> None:
        """
        Raises:
            ConnectionFailed: the process cannot connect; the message says why.
        """
        self._pipe, theirs = Pipe()
        self._sending = Lock()
        # Not by multiprocessing, which would load the main program once more; in a session of its
        # own, because Ctrl-C is for the executive, which stops the arms in order.
        self._process = subprocess.Popen(
            [sys.executable, "-m", _PROGRAM, str(theirs.fileno())],
            pass_fds=[theirs.fileno()],
            start_new_session=True,
        )
        theirs.close()
        self._report: StreamReport | None = None
        self._asked = 0
        self._send(Begin(setup, log_file))
        begun: Begun = self._next(_BEGIN_S, _BEGIN_S)
        if begun.why_not:
            self._process.wait(_END_S)
            raise ConnectionFailed(begun.why_not)
        self.simulated_clock: bool = begun.simulated_clock
        self.realtime: bool = begun.realtime

    @property
    def pid(self) -> int:
        return self._process.pid

    def command(self, tick: Tick) -> None:
        """
        Raises:
            ServoLost: the process is gone.
        """
        self._send(tick)

    def snapshot(self) -> Snapshot:
        """
        Raises:
            ServoLost: the process is gone, or does not answer.
        """
        snapshot: Snapshot = self._ask("snapshot")
        return snapshot

    def clock_s(self) -> float:
        """
        Raises:
            ServoLost: the process is gone, or does not answer.
        """
        clock_s: float = self._ask("clock")
        return clock_s

    def report(self) -> StreamReport:
        """
        Raises:
            ServoLost: the process is gone, or does not answer.
        """
        if self._report is not None:
            return self._report
        report: StreamReport = self._ask("report")
        return report

    def close(self) -> None:
        """
        Raises:
            ServoLost: the process does not answer; it was ended.
        """
        if self._report is not None or self._process.poll() is not None:
            return
        try:
            self._report = self._ask("close", _END_S)
        finally:
            self._pipe.close()
            try:
                self._process.wait(_END_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()

    def _send(self, what: Begin | Tick | Request) -> None:
        try:
            with self._sending:
                self._pipe.send(what)
        except OSError as error:
            raise self._ended() from error

    def _ask(self, question: Question, within_s: float = _ANSWER_S) -> Any:
        """The answer to ``question``, and to no other one: after a time-out the answer that was
        waited for still comes, and must not be taken for the next one."""
        self._asked += 1
        self._send(Request(self._asked, question))
        until_s = monotonic() + within_s
        while True:
            answer: Answer = self._next(max(0.0, until_s - monotonic()), within_s)
            if answer.number == self._asked:
                return answer.content

    def _next(self, left_s: float, within_s: float) -> Any:
        """What comes next within ``left_s``, all that is left of ``within_s``."""
        try:
            if not self._pipe.poll(left_s):
                raise ServoLost(f"the process that drives the arms is silent for {within_s:g} s")
            return self._pipe.recv()
        except (EOFError, OSError) as error:
            raise self._ended() from error

    def _ended(self) -> ServoLost:
        """Its end of the pipe is closed: it has ended, or is about to."""
        try:
            code = self._process.wait(_END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            code = self._process.wait()
        return ServoLost(f"the process that drives the arms has ended (exit code {code})")
