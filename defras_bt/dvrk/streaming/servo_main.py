"""The process that streams set-points: ``python -m defras_bt.dvrk.streaming.servo_main FD``.

It is started by :class:`~defras_bt.dvrk.streaming.servo_process.ServoProcess` and loads little: no
executive, no twin.
"""

from __future__ import annotations

import gc
import os
import sys
from dataclasses import replace
from multiprocessing.connection import Connection

from defras_bt.dvrk.crtk.arm import CrtkArm
from defras_bt.dvrk.ros_packages import RosMissing
from defras_bt.dvrk.streaming.command_log import CommandLog
from defras_bt.dvrk.streaming.servo_loop import ServoLoop, Snapshot, StreamReport, Tick
from defras_bt.dvrk.streaming.servo_requests import Answer, Begin, Begun, Request
from defras_bt.dvrk.transport.connect import connect
from defras_bt.dvrk.transport.transport import ConnectionFailed

_USUAL_PRIORITY = 40


def serve(pipe: Connection) -> None:
    """The process: connect, drive, answer."""
    begin: Begin = pipe.recv()
    setup = begin.setup
    try:
        realtime = _preferred(setup.stream.realtime_priority)
        transport = connect(setup, "defras_servo")
    except (ConnectionFailed, RosMissing) as error:
        pipe.send(Begun(str(error)))
        return
    arms: dict[str, CrtkArm] = {name: CrtkArm(arm, transport) for name, arm in setup.arms.items()}
    for arm in arms.values():
        transport.announce(arm.name)
    loop = ServoLoop(setup, arms, transport, CommandLog(begin.log_file))
    # What was loaded stays for good; a collection that walks through it would cost a period.
    gc.collect()
    gc.freeze()
    loop.start()
    pipe.send(Begun("", transport.simulated_clock, realtime))
    try:
        _answer_all(loop, pipe, realtime)
    finally:
        transport.close()


def _answer_all(loop: ServoLoop, pipe: Connection, realtime: bool) -> None:
    while True:
        try:
            request = pipe.recv()
        except (EOFError, OSError):
            # The executive is gone, however it went: motion ends with it.
            loop.close()
            return
        if isinstance(request, Tick):
            loop.command(request)
            continue
        if request.question == "close":
            loop.close()
        try:
            pipe.send(Answer(request.number, _content(loop, request, realtime)))
        except OSError:
            # Whoever asked is gone; with the end of the pipe, which comes next, motion ends.
            continue
        if request.question == "close":
            return


def _content(loop: ServoLoop, request: Request, realtime: bool) -> Snapshot | StreamReport | float:
    if request.question == "snapshot":
        return loop.snapshot()
    if request.question == "clock":
        return loop.clock_s()
    return replace(loop.report(), realtime=realtime)


def _preferred(priority: int | None) -> bool:
    """Ask the system to let this process run before others; whether it does.

    None takes what is granted; a number must be.

    Raises:
        ConnectionFailed: a number is not granted.
    """
    if priority == 0:
        return False
    try:
        wanted = os.sched_param(_USUAL_PRIORITY if priority is None else priority)
        os.sched_setscheduler(0, os.SCHED_FIFO, wanted)
    except (OSError, AttributeError) as error:
        if priority is None:
            return False  # the check and every run's numbers say so
        raise ConnectionFailed(
            f"stream.realtime_priority {priority}: the system does not grant it ({error}); set it "
            "to 0, or allow it for your user in /etc/security/limits.conf (rtprio)"
        ) from error
    return True


if __name__ == "__main__":
    serve(Connection(int(sys.argv[1])))
