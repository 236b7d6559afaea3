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
from typing import Any

from defras_bt.dvrk.settings import Setup
from defras_bt.dvrk.streaming.servo_loop import Snapshot, StreamReport, Tick
from defras_bt.dvrk.streaming.servo_requests import Begin, Begun, Request
from defras_bt.dvrk.transport.transport import ConnectionFailed

_BEGIN_S = 20.0
_ANSWER_S = 1.0
_END_S = 5.0
_PROGRAM = "defras_bt.dvrk.streaming.servo_main"


class ServoLost(RuntimeError):
    """The process that streams set-points does not answer; the arms hold where they are."""


class ServoProcess:
    """As :class:`ServoLoop`, in a process of its own."""

    def __init__(self, setup: Setup, log_file: Path | None = None) -> None:
        """
        Raises:
            ConnectionFailed: the process cannot connect; the message says why.
        """
        self._pipe, theirs = Pipe()
        # Not by multiprocessing, which would load the main program once more; in a session of its
        # own, because Ctrl-C is for the executive, which stops the arms in order.
        self._process = subprocess.Popen(
            [sys.executable, "-m", _PROGRAM, str(theirs.fileno())],
            pass_fds=[theirs.fileno()],
            start_new_session=True,
        )
        theirs.close()
        self._report: StreamReport | None = None
        self._send(Begin(setup, log_file))
        begun: Begun = self._answer(_BEGIN_S)
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
        self._send("snapshot")
        snapshot: Snapshot = self._answer(_ANSWER_S)
        return snapshot

    def clock_s(self) -> float:
        """
        Raises:
            ServoLost: the process is gone, or does not answer.
        """
        self._send("clock")
        clock_s: float = self._answer(_ANSWER_S)
        return clock_s

    def report(self) -> StreamReport:
        """
        Raises:
            ServoLost: the process is gone, or does not answer.
        """
        if self._report is not None:
            return self._report
        self._send("report")
        report: StreamReport = self._answer(_ANSWER_S)
        return report

    def close(self) -> None:
        if self._report is not None or self._process.poll() is not None:
            return
        try:
            self._send("close")
            self._report = self._answer(_END_S)
        finally:
            self._pipe.close()
            try:
                self._process.wait(_END_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()

    def _send(self, what: Begin | Tick | Request) -> None:
        try:
            self._pipe.send(what)
        except OSError as error:
            raise ServoLost(f"the process that drives the arms has ended ({error})") from error

    def _answer(self, within_s: float) -> Any:
        try:
            if not self._pipe.poll(within_s):
                raise ServoLost(f"the process that drives the arms is silent for {within_s:g} s")
            return self._pipe.recv()
        except (EOFError, OSError) as error:
            code = self._process.poll()
            raise ServoLost(
                f"the process that drives the arms has ended (exit code {code})"
            ) from error
