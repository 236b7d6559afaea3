"""The thread that streams, its beat, and its numbers."""

from __future__ import annotations

import csv
import errno
from pathlib import Path
from threading import Event, Thread
from time import monotonic, sleep

import numpy as np
import pytest

from defras_bt.dvrk.crtk.arm import CrtkArm
from defras_bt.dvrk.settings import Limits
from defras_bt.dvrk.stream_values import stream_values
from defras_bt.dvrk.streaming.beat import ClockBeat, WallBeat
from defras_bt.dvrk.streaming.command_log import COLUMNS, CommandLog
from defras_bt.dvrk.streaming.drive import ArmMotion
from defras_bt.dvrk.streaming.periods import Durations
from defras_bt.dvrk.streaming.servo_loop import ServoLoop, Tick
from defras_bt.dvrk.streaming.tip_stream import TipVelocity
from defras_bt.recording.run_file import StreamLog
from defras_sim.geometry import Pose
from tests.dvrk.toy_robot import BEGIN_S, ToyTransport, toy_setup

UP = TipVelocity(np.array([0.0, 0.0, 0.02]))


class LiveTransport(ToyTransport):
    """The toy on the wall's clock: everything is said at 100 Hz."""

    def __init__(self, *names: str) -> None:
        super().__init__(*names)
        self._began_s = monotonic()
        self._end = Event()
        self._thread = Thread(target=self._run, daemon=True)

    def start(self) -> None:
        self._thread.start()

    def now_s(self) -> float:
        return BEGIN_S + monotonic() - self._began_s

    def _run(self) -> None:
        while not self._end.wait(0.01):
            self.clock_s = self.now_s()
            self.publish()

    def close(self) -> None:
        self._end.set()
        self._thread.join()


@pytest.fixture
def transport():
    transport = LiveTransport("PSM1", "PSM2")
    yield transport
    transport.close()


def looping(transport: LiveTransport, log: CommandLog) -> ServoLoop:
    setup = toy_setup(limits=Limits(arm_age_s=1.0))
    arms = {str(name): CrtkArm(arm, transport) for name, arm in setup.arms.items()}
    loop = ServoLoop(setup, arms, transport, log)
    transport.start()
    loop.start()
    wait_for(lambda: not any(arm.stopped for arm in loop.snapshot().arms.values()))
    return loop


def wait_for(reached, within_s: float = 5.0) -> None:
    until_s = monotonic() + within_s
    while not reached():
        assert monotonic() < until_s
        sleep(0.005)


def test_a_tick_is_streamed_and_counted(transport: LiveTransport, tmp_path: Path) -> None:
    loop = looping(transport, CommandLog(tmp_path / "stream.csv"))
    for _ in range(8):
        loop.command(Tick({"psm1": ArmMotion(UP)}, 0.05, {"psm1": loop.clock_s() - 0.01}))
        sleep(0.05)
    # A tree that learned for long ends in a hold, which says nothing of how old motion may be.
    loop.command(Tick({}, 0.05, {"psm1": loop.clock_s() - 30.0}))
    sleep(0.05)
    loop.close()
    report = loop.report()
    assert report.broke == ""
    assert report.period.count > 5
    assert 0.01 <= report.latency_s["psm1"][0] <= report.latency_s["psm1"][1] < 1.0
    assert {arm for _, arm, _ in transport.sent} == {"PSM1"}, "nobody else was told to move"
    StreamLog.model_validate(stream_values(report))
    with (tmp_path / "stream.csv").open() as stream:
        assert len(list(csv.DictReader(stream))) == len(transport.sent)


def test_a_stream_that_breaks_says_so_and_sends_no_more(
    transport: LiveTransport, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("threading.excepthook", lambda _: None)
    loop = looping(transport, CommandLog())

    def broken(arm: str, pose: Pose, frame: str) -> None:
        raise RuntimeError("publish() to a closed topic")

    monkeypatch.setattr(transport, "servo_cp", broken)
    loop.command(Tick({"psm1": ArmMotion(UP)}, 0.05))
    wait_for(lambda: loop.snapshot().broke)
    assert "RuntimeError: publish() to a closed topic" in loop.snapshot().broke
    loop.close()
    assert transport.sent == []


def test_a_full_disk_ends_the_stream_and_says_so(
    transport: LiveTransport, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = CommandLog()
    loop = looping(transport, log)

    def full(now_s: float = float("inf")) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(log, "write", full)
    wait_for(lambda: loop.snapshot().broke)
    wait_for(lambda: not loop._thread.is_alive())
    loop.command(Tick({"psm1": ArmMotion(UP)}, 0.05))
    sleep(0.05)
    assert transport.sent == []
    loop.close()
    assert "cannot be logged: [Errno 28] No space left on device" in loop.report().broke


class TestBeat:
    """Periods of the wall, and of a simulation."""

    def test_periods_of_the_wall_tell_what_passed(self) -> None:
        beat, began_s = WallBeat(0.005), monotonic()
        passed_s = sum(beat.wait() for _ in range(20))
        assert passed_s == pytest.approx(monotonic() - began_s, abs=0.01)
        assert passed_s >= 20 * 0.005 - 0.005

    def test_a_period_that_was_missed_is_not_made_up_for(self) -> None:
        beat = WallBeat(0.005)
        beat.wait()
        sleep(0.05)
        assert beat.wait() >= 0.05
        assert beat.wait() >= 0.004

    def test_a_simulation_moves_the_beat(self) -> None:
        shown = iter([10.0, 10.005, 10.01, 10.02, 10.03])
        beat = ClockBeat(0.01, lambda: next(shown))
        assert beat.wait() == pytest.approx(0.01)
        assert beat.wait() == pytest.approx(0.01)

    def test_while_a_simulation_stands_no_time_passes(self) -> None:
        beat = ClockBeat(0.01, lambda: 10.0)
        assert beat.wait() == 0.0


class TestDurations:
    """Counted in bins."""

    def test_against_numpy(self) -> None:
        rng = np.random.default_rng(0)
        times_s = rng.gamma(20.0, 0.0005, 5000)
        durations = Durations()
        for time_s in times_s:
            durations.add(float(time_s))
        for share in (0.5, 0.99):
            assert durations.quantile_s(share) == pytest.approx(
                np.quantile(times_s, share), abs=4e-5
            )
        assert durations.longest_s == times_s.max()

    def test_none_yet(self) -> None:
        assert Durations().quantile_s(0.5) is None
        assert Durations().longest_s is None


class TestCommandLog:
    """One line for each set-point."""

    POSE = Pose(np.array([0.1, 0.2, 0.3]))

    def test_a_line_waits_for_its_echo(self, tmp_path: Path) -> None:
        file = tmp_path / "stream.csv"
        log = CommandLog(file)
        log.sent("PSM1", 5.0, self.POSE)
        log.sent("PSM1", 5.01, self.POSE)
        log.applied("PSM1", 5.0, 5.012)
        file.write_text("of an earlier run")
        log.write(5.5)
        assert file.read_text() == "of an earlier run", "they may still be told apart"
        log.write()
        head, *lines = file.read_text().splitlines()
        assert head == ",".join(COLUMNS)
        assert lines[0].startswith("PSM1,5.000000,5.012000,0.1000000,")
        assert lines[1].startswith("PSM1,5.010000,,0.1000000,"), "no echo, no time"
        assert log.took_up.count == 1

    def test_without_a_file_nothing_piles_up(self) -> None:
        log = CommandLog()
        for number in range(100):
            log.sent("PSM1", float(number), self.POSE)
        log.write(1000.0)
        assert not log._lines


def test_where_one_arm_must_not_be_driven_the_other_stands_still(
    transport: LiveTransport, tmp_path: Path
) -> None:
    loop = looping(transport, CommandLog(tmp_path / "stream.csv"))

    def still(count: int) -> bool:
        """Whether PSM1 was sent to one and the same place the last ``count`` times."""
        places = [pose.position_m for _, arm, pose in list(transport.sent) if arm == "PSM1"]
        return len(places) > count and not np.ptp(places[-count:], axis=0).any()

    try:
        loop.command(Tick({"psm1": ArmMotion(UP)}, 0.05))
        wait_for(lambda: any(arm == "PSM1" for _, arm, _ in list(transport.sent)))
        transport.arms["PSM2"].state = "PAUSED"

        def tells_why() -> bool:
            loop.command(Tick({"psm1": ArmMotion(UP)}, 0.05))
            return "PAUSED" in loop.snapshot().arms["psm2"].stopped

        wait_for(tells_why)
        wait_for(lambda: still(5))
    finally:
        loop.close()
