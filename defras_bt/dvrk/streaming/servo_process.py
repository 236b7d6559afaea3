"""The stream of set-points in a process of its own.

The twin computes for tens of milliseconds in the executive's process, and Python lets one thread
run at a time: a stream beside it would stumble. It also goes on holding when the executive hangs,
and ends when the executive is gone.
"""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Literal

from defras_bt.dvrk.crtk.arm import CrtkArm
from defras_bt.dvrk.ros_packages import RosMissing
from defras_bt.dvrk.settings import Setup
from defras_bt.dvrk.streaming.command_log import CommandLog
from defras_bt.dvrk.streaming.servo_loop import ServoLoop, Snapshot, StreamReport, Tick
from defras_bt.dvrk.transport.connect import connect
from defras_bt.dvrk.transport.transport import ConnectionFailed

_BEGIN_S = 20.0
_ANSWER_S = 1.0
_END_S = 5.0

Request = Literal["snapshot", "report", "close"]


class ServoLost(RuntimeError):
    """The process that streams set-points does not answer; the arms hold where they are."""


@dataclass(frozen=True)
class _Begun:
    """The stream's process is ready; ``why_not`` says why it is not."""

    why_not: str = ""


class ServoProcess:
    """As :class:`ServoLoop`, in a process of its own."""

    def __init__(self, setup: Setup, log_file: Path | None = None) -> None:
        """
        Raises:
            ConnectionFailed: the process cannot connect; the message says why.
        """
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(
            target=_serve, args=(setup, log_file, theirs), name="defras servo", daemon=True
        )
        self._process.start()
        theirs.close()
        self._report: StreamReport | None = None
        begun = self._answer(_BEGIN_S)
        if begun.why_not:
            self._process.join(_END_S)
            raise ConnectionFailed(begun.why_not)

    @property
    def pid(self) -> int | None:
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
        if self._report is not None or not self._process.is_alive():
            return
        try:
            self._send("close")
            self._report = self._answer(_END_S)
        finally:
            self._pipe.close()
            self._process.join(_END_S)
            if self._process.is_alive():
                self._process.kill()
                self._process.join()

    def _send(self, what: Tick | Request) -> None:
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
            code = self._process.exitcode
            raise ServoLost(
                f"the process that drives the arms has ended (exit code {code})"
            ) from error


def _serve(setup: Setup, log_file: Path | None, pipe: Connection) -> None:
    """The process: connect, drive, answer."""
    # Ctrl-C is for the executive, which stops the arms in order.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        _prefer(setup.stream.realtime_priority)
        transport = connect(setup, "defras_servo")
    except (ConnectionFailed, RosMissing) as error:
        pipe.send(_Begun(str(error)))
        return
    arms: dict[str, CrtkArm] = {
        name: CrtkArm(arm, transport) for name, arm in setup.arms.items()
    }
    for arm in arms.values():
        transport.announce(arm.name)
    loop = ServoLoop(setup, arms, transport, CommandLog(log_file))
    # What was loaded stays for good; a collection that walks through it would cost a period.
    gc.collect()
    gc.freeze()
    loop.start()
    pipe.send(_Begun())
    try:
        _answer_all(loop, pipe)
    finally:
        transport.close()


def _answer_all(loop: ServoLoop, pipe: Connection) -> None:
    while True:
        try:
            request = pipe.recv()
        except (EOFError, OSError):
            # The executive is gone, however it went: motion ends with it.
            loop.close()
            return
        if isinstance(request, Tick):
            loop.command(request)
        elif request == "snapshot":
            pipe.send(loop.snapshot())
        elif request == "report":
            pipe.send(loop.report())
        else:
            loop.close()
            pipe.send(loop.report())
            return


def _prefer(priority: int) -> None:
    """Ask the system to let this process run before others.

    Raises:
        ConnectionFailed: it refuses.
    """
    if priority == 0:
        return
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except (OSError, AttributeError) as error:
        raise ConnectionFailed(
            f"stream.realtime_priority {priority}: the system does not grant it ({error}); set it "
            "to 0, or allow it for your user in /etc/security/limits.conf (rtprio)"
        ) from error
