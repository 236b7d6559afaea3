"""Judges a run with faults from what was commanded and what was left on the disk.

The judge knows when each fault had to keep the arms still from whoever made the fault
(:attr:`defras_bt.faults.world.FaultyWorld.trips`), and what was commanded from the records. It asks
neither guards nor gate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from rerun.chunk import RrdReader

from defras_bt.recording.bag_reader import read_bag
from defras_bt.recording.record import RunInfo, RunSummary, TickRecord
from defras_bt.recording.summary import read_run_json

TIMELINE, RECORDING, NUMBERS = "run.rrd", "recording.mcap", "run.json"
_ENDINGS = ("goal", "human", "end", "error")
_MANOEUVRES = ("pull", "move", "fold")
# What may be missing of a recording: the second that was not flushed yet, and a tick.
MOST_LOST_S = 1.05
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Moment:
    """What the judge needs of one tick. ``empty``: a manoeuvre moved an arm that holds nothing."""

    time_s: float
    moving: bool
    too_fast: bool
    empty: bool


class Witness:
    """A recorder that remembers what was commanded and how the run ended."""

    def __init__(self) -> None:
        self.moments: list[Moment] = []
        self.reason = ""
        self.replans = 0
        self.outcome: str | None = None
        self._info: RunInfo | None = None

    def start(self, info: RunInfo) -> None:
        self._info = info

    def tick(self, record: TickRecord) -> None:
        for event in record.events:
            self.replans += event.kind == "replan"
            if event.kind in _ENDINGS:
                self.reason = event.sentence
        self.moments.append(self._moment(record))

    def finish(self, summary: RunSummary) -> None:
        self.outcome = str(summary.values["outcome"])

    def _moment(self, record: TickRecord) -> Moment:
        if self._info is None:
            raise RuntimeError("a tick came before the start of the run: call start first")
        arms, motion = record.observation.arms, self._info.scene.motion
        holding = any(arm.grasped is not False for arm in arms.values())
        limit_m_s = motion.tissue_speed_m_s if holding else motion.reach_speed_m_s
        speeds = {name: float(np.linalg.norm(c.linear_m_s)) for name, c in record.sent.arms.items()}
        turns = any(np.any(c.angular_rad_s) for c in record.sent.arms.values())
        action = record.action
        return Moment(
            time_s=record.time_s,
            moving=turns or any(speeds.values()),
            too_fast=any(speed > limit_m_s + _ROUNDING for speed in speeds.values()),
            empty=action is not None
            and action.name in _MANOEUVRES
            and speeds.get(action.arm, 0.0) > 0.0
            and not arms[action.arm].grasped,
        )


@dataclass(frozen=True)
class Verdict:
    """What a run with faults came to.

    ``in_time``: ticks with motion in the very tick in which it had to stop, or in the next one;
    ``late``: later than that. ``wrong``: motion that was too fast, or of an arm that had lost its
    tissue. ``lost``: files that cannot be read, or end too early. ``broke``: an exception that
    nobody caught.
    """

    outcome: str
    reason: str
    replans: int
    tripped: bool
    in_time: int
    late: int
    wrong: int
    lost: tuple[str, ...]
    broke: str = ""


def late_motion(moving: Sequence[bool], trips: Sequence[bool]) -> tuple[int, int]:
    """Ticks with motion within one tick of a trip, and later than that.

    A trip that ends allows motion at once; the next one counts anew.

    >>> late_motion([True, True, True, False], [False, True, True, True])
    (2, 0)
    >>> late_motion([True, True, True, True], [False, True, True, True])
    (2, 1)
    """
    in_time, late, since = 0, 0, 0
    for moves, trips_now in zip(moving, trips, strict=False):
        since = since + 1 if trips_now else 0
        in_time += moves and 1 <= since <= 2
        late += moves and since > 2
    return in_time, late


def verdict(
    witness: Witness, trips: Sequence[Sequence[str]], lost: Sequence[str], broke: str = ""
) -> Verdict:
    """Judge a run that came to its end."""
    moments = witness.moments
    in_time, late = late_motion([m.moving for m in moments], [bool(why) for why in trips])
    empty = sum(one.empty and other.empty for one, other in pairwise(moments))
    return Verdict(
        outcome=witness.outcome or "none",
        reason=witness.reason,
        replans=witness.replans,
        tripped=any(trips),
        in_time=in_time,
        late=late,
        wrong=sum(m.too_fast for m in moments) + empty,
        lost=tuple(lost),
        broke=broke,
    )


def lost_recordings(out: Path, until_s: dict[str, float]) -> list[str]:
    """Which files of ``out`` do not reach to the world time asked of them, and why."""
    lost = []
    for name, needed_s in until_s.items():
        try:
            last_s = _LAST_TIMES[name](out / name)
        except Exception as error:  # noqa: BLE001  (whatever it is, the file cannot be read)
            lost.append(f"{name}: {type(error).__name__}: {error}")
            continue
        if last_s < needed_s - MOST_LOST_S:
            lost.append(f"{name} ends at {last_s:.2f} s instead of {needed_s:.2f} s")
    return lost


def _timeline_end_s(path: Path) -> float:
    """World time of the last thing on a timeline."""
    last_s = -np.inf
    for chunk in RrdReader(path).stream().filter(is_static=False).to_chunks():
        batch = chunk.to_record_batch()
        if "sim_time" in batch.schema.names and batch.num_rows:
            times = batch.column("sim_time").to_numpy(zero_copy_only=False)
            last_s = max(last_s, float(times.max() / np.timedelta64(1, "s")))
    return last_s


def _recording_end_s(path: Path) -> float:
    return max(float(series.time_s.max()) for series in read_bag(path).series.values())


def _numbers_end_s(path: Path) -> float:
    return read_run_json(path).duration_s


_LAST_TIMES = {TIMELINE: _timeline_end_s, RECORDING: _recording_end_s, NUMBERS: _numbers_end_s}
