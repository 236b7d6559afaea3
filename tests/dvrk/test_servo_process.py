"""The stream in a process of its own, with toy arms on the loopback."""

from __future__ import annotations

import csv
import os
import signal
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, sleep

import numpy as np
import pytest

from defras_bt.dvrk.settings import Limits, Setup, SocketTransport
from defras_bt.dvrk.streaming.drive import ArmMotion, ArmSnapshot
from defras_bt.dvrk.streaming.servo_loop import StreamReport, Tick
from defras_bt.dvrk.streaming.servo_process import ServoLost, ServoProcess
from defras_bt.dvrk.streaming.tip_stream import TipVelocity
from defras_bt.dvrk.transport.transport import ConnectionFailed
from tests.dvrk.toy_robot import toy_setup
from tests.dvrk.toy_streamers import ToyStreamers, free_ports

UP = np.array([0.0, 0.0, 0.02])


@dataclass
class Running:
    """A process, the arms it drives, and its log."""

    servo: ServoProcess
    robot: ToyStreamers
    log: Path

    def arm(self) -> ArmSnapshot:
        return self.servo.snapshot().arms["psm1"]

    def go(self, ticks: int) -> None:
        for _ in range(ticks):
            self.servo.command(Tick({"psm1": ArmMotion(TipVelocity(UP), 0.5)}, 0.05))
            sleep(0.05)


def patient(ports: list[int]) -> Setup:
    """A set-up for machines where anything may take its time: patience is not what is tested."""
    return toy_setup(
        transport=SocketTransport(ports={"psm1": ports[0], "psm2": ports[1]}),
        limits=Limits(arm_age_s=1.0),
    )


@pytest.fixture
def running(tmp_path: Path) -> Iterator[Running]:
    ports = free_ports(2)
    robot = ToyStreamers({"PSM1": ports[0], "PSM2": ports[1]})
    servo = ServoProcess(patient(ports), tmp_path / "stream.csv")
    running = Running(servo, robot, tmp_path / "stream.csv")
    until_s = monotonic() + 10.0
    while any(arm.stopped for arm in servo.snapshot().arms.values()) and monotonic() < until_s:
        sleep(0.02)
    yield running
    servo.close()
    robot.close()


# Counts periods in real time: where a busy machine starves the arms for a second, they stop.
@pytest.mark.flaky(reruns=2)
def test_an_arm_is_driven_and_everything_logged(running: Running) -> None:
    start_m = running.robot.arms["PSM1"].setpoint.position_m
    running.go(20)
    sleep(0.2)
    gone_m = running.robot.arms["PSM1"].setpoint.position_m - start_m
    assert 0.5 * 20 * 0.001 < gone_m[2] <= 20 * 0.001 + 1e-9
    assert running.robot.arms["PSM1"].jaw_setpoint_rad == pytest.approx(0.5)
    goal = running.arm().goal
    assert goal is not None
    running.servo.close()
    report = running.servo.report()
    assert report.period.count > 20
    assert report.took_up_s is not None
    with running.log.open() as stream:
        lines = list(csv.DictReader(stream))
    assert len(lines) > 20
    assert {line["arm"] for line in lines} == {"PSM1"}
    sent_s = [float(line["sent_s"]) for line in lines]
    assert sent_s == sorted(sent_s)
    assert any(line["applied_s"] for line in lines)
    heights = np.array([float(line["z_m"]) for line in lines])
    assert (np.diff(heights) >= 0.0).all()
    assert np.diff(heights).max() <= 0.001 + 1e-7, "no step is longer than the limit"


def test_a_pause_is_seen_and_told(running: Running) -> None:
    running.go(4)
    running.robot.arms["PSM1"].state = "PAUSED"
    until_s, stopped = monotonic() + 5.0, ""
    while not stopped and monotonic() < until_s:
        running.go(1)
        stopped = running.arm().stopped
    assert "PAUSED" in stopped
    assert running.arm().goal is None


def test_a_process_that_is_killed_is_missed(running: Running) -> None:
    os.kill(running.servo.pid, signal.SIGKILL)
    with pytest.raises(ServoLost, match="has ended"):
        running.arm()


def test_an_answer_that_comes_too_late_is_not_taken_for_the_next(running: Running) -> None:
    os.kill(running.servo.pid, signal.SIGSTOP)
    try:
        with pytest.raises(ServoLost, match="is silent for 1 s"):
            running.servo.snapshot()
    finally:
        os.kill(running.servo.pid, signal.SIGCONT)
    assert isinstance(running.servo.clock_s(), float)
    assert isinstance(running.servo.report(), StreamReport)
    assert set(running.servo.snapshot().arms) == {"psm1", "psm2"}
    running.servo.close()
    assert running.servo.report().broke == ""


def test_nobody_to_connect_to() -> None:
    ports = free_ports(1)
    with pytest.raises(ConnectionFailed, match="is another program listening"):
        ServoProcess(patient([ports[0], ports[0]]))
