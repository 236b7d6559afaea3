"""The thread that sends set-points, one period after the other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from threading import Event, Lock, Thread
from typing import Protocol

from defras_bt.dvrk.crtk.arm import CrtkArm
from defras_bt.dvrk.settings import Setup
from defras_bt.dvrk.streaming.beat import Beat, ClockBeat, WallBeat
from defras_bt.dvrk.streaming.command_log import CommandLog
from defras_bt.dvrk.streaming.drive import ArmDrive, ArmMotion, ArmSnapshot
from defras_bt.dvrk.streaming.periods import Durations, PeriodReport
from defras_bt.dvrk.transport.transport import Transport

_LONGEST_PERIODS = 2.0
"""A period that began late counts as no longer than this: no set-point makes up for more."""
_LOG_EVERY_S = 0.5


@dataclass(frozen=True)
class Tick:
    """One command of the executive. ``stamps_s``: when what it was decided on was measured, by
    the sensor's name, on the robot's clock. An arm that is not named stops."""

    motions: Mapping[str, ArmMotion]
    tick_s: float
    stamps_s: Mapping[str, float] = field(default_factory=dict)

    @property
    def moves(self) -> bool:
        """Whether a tip is to go anywhere."""
        return any(motion.velocity.moves for motion in self.motions.values())


@dataclass(frozen=True)
class Snapshot:
    """``clock_s`` on the robot's clock, and every arm as it was last heard, by its key.
    ``broke``: why set-points are sent no more, in words."""

    clock_s: float
    arms: Mapping[str, ArmSnapshot]
    broke: str = ""


@dataclass(frozen=True)
class StreamReport:
    """``period``: between set-points, while any were sent. ``latency_s``: by sensor, from its
    stamp to the first set-point of a motion decided on it, median and 99th percentile: a hold may
    be decided on anything, however old. ``took_up_s``: from sending to the echo. ``broke``: what
    ended the stream, in words. ``realtime``: whether the system let the stream run before other
    programs."""

    period: PeriodReport
    latency_s: Mapping[str, tuple[float, float]]
    took_up_s: tuple[float, float] | None
    broke: str = ""
    realtime: bool = False


class Servo(Protocol):
    """Who drives the arms: in this process, or in one of its own."""

    def command(self, tick: Tick) -> None:
        """Carried out from the next period on; a tick that was not begun yet is replaced."""

    def snapshot(self) -> Snapshot:
        """All arms as they were last heard."""

    def clock_s(self) -> float:
        """The time on the robot's clock."""

    def report(self) -> StreamReport:
        """How regular the stream was so far, and how long its ways took."""

    def close(self) -> None:
        """Stop, send nothing more, and write what is left of the log."""


class ServoLoop:
    """Drives all arms of a set-up from one thread. Methods may be called from any other."""

    def __init__(
        self,
        setup: Setup,
        arms: Mapping[str, CrtkArm],
        transport: Transport,
        log: CommandLog,
    ) -> None:
        self._period_s = setup.stream.period_s
        self._transport = transport
        self._log = log
        self._drives = {
            name: ArmDrive(arm, setup.stream, setup.limits, log) for name, arm in arms.items()
        }
        self._periods = Durations()
        self._latencies: dict[str, Durations] = {}
        self._tick: Tick | None = None
        self._lock = Lock()
        self._end = Event()
        self.broke = ""
        self._thread = Thread(target=self._run, name="servo", daemon=True)
        self._writer = Thread(target=self._write, name="command log", daemon=True)

    def start(self) -> None:
        self._thread.start()
        self._writer.start()

    def command(self, tick: Tick) -> None:
        with self._lock:
            self._tick = tick

    def snapshot(self) -> Snapshot:
        with self._lock:
            arms = {name: drive.snapshot() for name, drive in self._drives.items()}
        return Snapshot(self._transport.now_s(), arms, self.broke)

    def clock_s(self) -> float:
        return self._transport.now_s()

    def report(self) -> StreamReport:
        took_up = self._log.took_up
        return StreamReport(
            self._periods.report(self._period_s),
            {name: _two(durations) for name, durations in self._latencies.items()},
            _two(took_up) if took_up.count else None,
            self.broke,
        )

    def close(self) -> None:
        self._end.set()
        for thread in (self._thread, self._writer):
            if thread.ident is not None:
                thread.join()
        self._write_log()

    def _run(self) -> None:
        try:
            self._stream()
        except Exception as error:
            # Silence is a hold; who asks for the next snapshot is told why there is silence.
            self.broke = f"the stream of set-points broke: {type(error).__name__}: {error}"
            raise

    def _stream(self) -> None:
        beat, streamed = self._beat(), False
        while not (self._end.is_set() or self.broke):
            elapsed_s = beat.wait()
            if streamed:
                self._periods.add(elapsed_s)
            streamed = self._period(min(elapsed_s, _LONGEST_PERIODS * self._period_s))
        now_s = self._transport.now_s()
        for drive in self._drives.values():
            drive.end(now_s)

    def _beat(self) -> Beat:
        if self._transport.simulated_clock:
            return ClockBeat(self._period_s, self._transport.now_s)
        return WallBeat(self._period_s)

    def _period(self, elapsed_s: float) -> bool:
        now_s, lost = self._transport.now_s(), self._transport.lost()
        with self._lock:
            tick, self._tick = self._tick, None
            if tick is not None:
                for name, drive in self._drives.items():
                    drive.command(tick.motions.get(name), tick.tick_s, now_s)
            stopped = {name for name, drive in self._drives.items() if drive.standing.stopped}
            sent = [
                drive.period(now_s, elapsed_s, lost, others_stopped=bool(stopped - {name}))
                for name, drive in self._drives.items()
            ]
        if tick is not None and tick.moves and any(sent):
            for sensor, stamp_s in tick.stamps_s.items():
                self._latencies.setdefault(sensor, Durations()).add(now_s - stamp_s)
        return any(sent)

    def _write(self) -> None:
        while not self._end.wait(_LOG_EVERY_S):
            self._write_log(self._transport.now_s())

    def _write_log(self, now_s: float = float("inf")) -> None:
        """What cannot be recorded is not sent either: the stream ends, and says why."""
        try:
            self._log.write(now_s)
        except OSError as error:
            self.broke = self.broke or f"set-points cannot be logged: {error}"


def _two(durations: Durations) -> tuple[float, float]:
    median_s, p99_s = durations.quantile_s(0.5), durations.quantile_s(0.99)
    assert median_s is not None
    assert p99_s is not None
    return median_s, p99_s
