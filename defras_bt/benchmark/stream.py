"""How regular a stream of set-points is while the twin computes, in a thread and in a process."""

from __future__ import annotations

import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from time import monotonic, sleep
from typing import Any

import numpy as np

from defras_bt.dvrk.crtk.arm import CrtkArm
from defras_bt.dvrk.settings import ArmSetup, Limits, Setup, SocketTransport, Stream
from defras_bt.dvrk.streaming.command_log import CommandLog
from defras_bt.dvrk.streaming.drive import ArmMotion
from defras_bt.dvrk.streaming.servo_loop import Servo, ServoLoop, StreamReport, Tick
from defras_bt.dvrk.streaming.servo_process import ServoProcess
from defras_bt.dvrk.streaming.tip_stream import TipVelocity
from defras_bt.dvrk.transport.connect import connect
from defras_sim.geometry import Pose
from defras_sim.scene import Scene
from defras_sim.twin import Twin
from defras_sim.worlds.kinematic_tool import POINTING_DOWN

WAYS = ("thread", "process", "process, real-time")
_PROGRAM = "defras_bt.benchmark.stream_arms"
_HEARD_S = 10.0
_PATIENCE_S = 1.0
"""Messages may be so old here: what is measured is the stream, however busy the machine is."""
_SPEED_M_S = 0.015
_LIFT_M = 0.02


@dataclass(frozen=True)
class StreamTiming:
    """One way to stream beside the twin. ``ticks``: how many the executive's side managed."""

    way: str
    report: StreamReport
    ticks: int
    twin_s: float

    def row(self) -> dict[str, Any]:
        """For a table, times in ms."""
        period = self.report.period
        nominal_ms = period.nominal_s * 1e3
        p99_ms = None if period.p99_s is None else period.p99_s * 1e3
        latency = self.report.latency_s.get("psm1")
        return {
            "way": self.way,
            "set-points": period.count,
            "nominal ms": nominal_ms,
            "median ms": None if period.median_s is None else period.median_s * 1e3,
            "99th percentile ms": p99_ms,
            "to nominal": None if p99_ms is None else p99_ms / nominal_ms,
            "longest ms": None if period.longest_s is None else period.longest_s * 1e3,
            "sensor to set-point, median ms": None if latency is None else latency[0] * 1e3,
            "99th ms": None if latency is None else latency[1] * 1e3,
            "twin ms per tick": self.twin_s / max(self.ticks, 1) * 1e3,
            "real-time granted": self.report.realtime,
        }


def measure(scene: Scene, seconds: float, ways: Sequence[str] = WAYS) -> Iterator[StreamTiming]:
    """Stream for ``seconds`` each way, while a twin of ``scene`` follows a pull."""
    for way in ways:
        ports = _free_ports(2)
        setup = _setup(ports, realtime=way == WAYS[2])
        with _arms(ports), _servo(setup, own_process=way != WAYS[0]) as servo:
            _wait_until_heard(servo)
            ticks, twin_s = _operate(scene, servo, seconds)
            yield StreamTiming(way, servo.report(), ticks, twin_s)


def _operate(scene: Scene, servo: Servo, seconds: float) -> tuple[int, float]:
    """The executive's side: every tick the twin, then a command; how many, and the twin's time."""
    twin, at_m = Twin(scene), scene.grasp_point_m(2, 4)
    twin.grasp("psm1", Pose(at_m, POINTING_DOWN), 0.0)
    began_s = due_s = monotonic()
    ticks, twin_s, height_m, way = 0, 0.0, 0.0, 1.0
    while monotonic() - began_s < seconds:
        due_s = max(due_s + scene.tick_s, monotonic())
        sleep(max(0.0, due_s - monotonic()))
        seen = servo.snapshot().arms["psm1"].measured
        if abs(height_m - _LIFT_M / 2) >= _LIFT_M / 2:
            way = 1.0 if height_m <= 0.0 else -1.0
        height_m = min(max(height_m + way * _SPEED_M_S * scene.tick_s, 0.0), _LIFT_M)
        started_s = monotonic()
        twin.track({"psm1": Pose(at_m + [0.0, 0.0, height_m], POINTING_DOWN)}, started_s - began_s)
        twin_s += monotonic() - started_s
        velocity = TipVelocity(np.array([0.0, 0.0, way * _SPEED_M_S]))
        stamps_s = {} if seen is None else {"psm1": seen.stamp_s}
        servo.command(Tick({"psm1": ArmMotion(velocity)}, scene.tick_s, stamps_s))
        ticks += 1
    return ticks, twin_s


def _setup(ports: Sequence[int], *, realtime: bool) -> Setup:
    return Setup(
        name="benchmark",
        transport=SocketTransport(ports={"psm1": ports[0], "psm2": ports[1]}),
        arms={
            "psm1": ArmSetup(name="PSM1", frame="PSM1_base"),
            "psm2": ArmSetup(name="PSM2", frame="PSM2_base"),
        },
        stream=Stream(realtime_priority=None if realtime else 0),
        limits=Limits(arm_age_s=_PATIENCE_S),
    )


@contextmanager
def _servo(setup: Setup, *, own_process: bool) -> Iterator[Servo]:
    if own_process:
        process = ServoProcess(setup)
        try:
            yield process
        finally:
            process.close()
        return
    transport = connect(setup)
    arms: dict[str, CrtkArm] = {name: CrtkArm(arm, transport) for name, arm in setup.arms.items()}
    loop = ServoLoop(setup, arms, transport, CommandLog())
    loop.start()
    try:
        yield loop
    finally:
        loop.close()
        transport.close()


@contextmanager
def _arms(ports: Sequence[int]) -> Iterator[None]:
    program = subprocess.Popen([sys.executable, "-m", _PROGRAM, *map(str, ports)])
    try:
        yield
    finally:
        program.kill()
        program.wait()


def _wait_until_heard(servo: Servo) -> None:
    until_s = monotonic() + _HEARD_S
    while any(arm.stopped for arm in servo.snapshot().arms.values()):
        if monotonic() > until_s:
            raise TimeoutError(f"the benchmark's arms say nothing within {_HEARD_S:g} s")
        sleep(0.02)


def _free_ports(count: int) -> list[int]:
    """UDP ports of the loopback that nobody uses."""
    sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(count)]
    try:
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]
    finally:
        for one in sockets:
            one.close()
