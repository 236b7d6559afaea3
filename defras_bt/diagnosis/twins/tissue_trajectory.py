"""One recording as a trajectory: the frames that are compared, and what was measured in them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from defras_bt.diagnosis.problem import Integers
from defras_bt.diagnosis.recording import Readings, RecordedRun
from defras_bt.diagnosis.twins.tissue_phases import PHASES, phases
from defras_bt.diagnosis.twins.tissue_pressed import pressed
from defras_sim.geometry import Floats
from defras_sim.recorded_motion import ArmMotion, RecordedMotion
from defras_sim.scene import Scene

MOST_FRAMES = 160
"""Frames beyond this many are thinned out evenly: neighbours say nearly the same."""
SOLVED_M, SOLVED_S = 0.005, 0.25
"""Frames nearer to each other than that, in the way of held tissue and in time, are not all solved:
tissue that turns about a hinge 40 mm away leaves the chord by 0.1 mm."""
_AFTER_RELEASE_S = 1.0
"""Tissue let go swings for a while, and a model in equilibrium cannot know how."""
_CORNER_M_S = 0.005
"""Change of a tip's velocity from one set-point to the next that makes a corner of its way."""
MOST_CORNERS = 60
_REST = PHASES.index("rest")
_RELEASED = PHASES.index("after release")


@dataclass(frozen=True)
class Trajectory:
    """``frames`` (f,): the instants of ``motion`` at which the camera looked, and ``clouds_m`` what
    it saw then; ``phase`` (f,) in :data:`PHASES`. By arm: ``tips_m`` (f, 3) as measured and
    ``forces_n`` (f, 3), NaN where nothing was measured, or where a jaw presses on the bed:
    ``pressed`` readings are left out.
    """

    name: str
    motion: RecordedMotion
    frames: Integers
    phase: Integers
    clouds_m: tuple[Floats, ...]
    tips_m: Mapping[str, Floats]
    forces_n: Mapping[str, Floats]
    pressed: int = 0

    @property
    def time_s(self) -> Floats:
        """Of the frames (f,)."""
        return np.asarray(self.motion.time_s[self.frames])

    @property
    def height_m(self) -> Floats:
        """Of the highest tip that holds tissue, over where it took it, as told (f,); 0 while none
        holds."""
        highest = np.zeros(len(self.motion))
        for arm in self.motion.arms.values():
            taken = np.flatnonzero(np.diff(arm.grasped.astype(np.int8), prepend=0) == 1)
            last = np.clip(
                np.searchsorted(taken, np.arange(len(highest)), side="right") - 1, 0, None
            )
            if len(taken):
                above = arm.position_m[:, 2] - arm.position_m[taken[last], 2]
                highest = np.maximum(highest, np.where(arm.grasped, above, 0.0))
        return np.asarray(highest[self.frames])

    @cached_property
    def solved(self) -> Integers:
        """The instants (m,) of the motion at which the tissue should be known: between two of them
        it goes about straight on, whichever delay the camera has."""
        held = np.stack([arm.grasped for arm in self.motion.arms.values()])
        changes = np.flatnonzero(np.any(held[:, 1:] != held[:, :-1], axis=0))
        return np.unique(
            np.concatenate([self._spread, _corners(self.motion), changes, changes + 1])
        ).astype(np.int64)

    @property
    def _spread(self) -> Integers:
        """Frames of which no two neighbours are farther apart in time or way than need be."""
        way = np.zeros(len(self.motion))
        for arm in self.motion.arms.values():
            gone = np.linalg.norm(np.diff(arm.position_m, axis=0), axis=1)
            way[1:] = np.maximum(way[1:], np.where(arm.grasped[1:], gone, 0.0))
        way_m, time_s = np.cumsum(way)[self.frames], self.time_s
        chosen = [0]
        for frame in range(1, len(self.frames)):
            after = min(frame + 1, len(self.frames) - 1)
            far = way_m[after] - way_m[chosen[-1]] > SOLVED_M
            late = time_s[after] - time_s[chosen[-1]] > SOLVED_S
            if far or late or frame == after:
                chosen.append(frame)
        return np.asarray(self.frames[chosen])


def trajectory(run: RecordedRun, scene: Scene, most_frames: int = MOST_FRAMES) -> Trajectory:
    """The frames of ``run`` that can be compared: those while the arms have set-points, without
    the swinging after a release."""
    told_s = run.motion.time_s
    stamps = run.cloud_times_s
    known = (stamps >= told_s[0] - 1e-6) & (stamps <= told_s[-1] + 1e-6)
    motion = _with_instants(run.motion, stamps[known])
    rows = np.searchsorted(motion.time_s, stamps[known] - 1e-7)
    phase = phases(motion, scene)
    usable = ~_swinging(motion, phase)[rows]
    rows, clouds = rows[usable], np.flatnonzero(known)[usable]
    stride = max(1, int(np.ceil(len(rows) / most_frames)))
    rows, clouds = rows[::stride], clouds[::stride]
    time_s = motion.time_s[rows]
    period_s = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.1

    def around(readings: Mapping[str, Readings]) -> dict[str, Floats]:
        return {arm: each.mean_around(time_s, period_s / 2) for arm, each in readings.items()}

    within_s = 3 * period_s
    forces_n, left_out = around(run.forces_n), 0
    for name, force_n in forces_n.items():
        if name not in motion.arms:
            continue  # a sensor of an arm that was told nothing
        onto_bed = pressed(motion.arms[name], rows.astype(np.int64), force_n)
        forces_n[name] = np.where(onto_bed[:, None], np.nan, force_n)
        left_out += int(onto_bed.sum())
    return Trajectory(
        run.name,
        motion,
        rows.astype(np.int64),
        phase[rows],
        tuple(run.clouds[i].points_m for i in clouds),
        {arm: each.at(time_s, within_s) for arm, each in run.measured_m.items()},
        forces_n,
        left_out,
    )


def _corners(motion: RecordedMotion) -> Integers:
    """Instants at which a tip that holds starts, stops or turns: the sharpest of them."""
    if len(motion) < 3:
        return np.zeros(0, np.int64)
    sharpest = np.zeros(len(motion))
    for arm in motion.arms.values():
        velocity = np.diff(arm.position_m, axis=0) / np.diff(motion.time_s)[:, None]
        change = np.linalg.norm(np.diff(velocity, axis=0), axis=1)
        held = arm.grasped[:-2] & arm.grasped[2:]
        sharpest[1:-1] = np.maximum(sharpest[1:-1], np.where(held, change, 0.0))
    corners = np.flatnonzero(sharpest > _CORNER_M_S)
    return corners[np.argsort(-sharpest[corners], kind="stable")][:MOST_CORNERS]


def _swinging(
    motion: RecordedMotion, phase: Integers
) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Instants (n,) shortly after an arm let go."""
    found = np.zeros(len(motion), bool)
    for arm in motion.arms.values():
        for let_go in np.flatnonzero(arm.grasped[:-1] & ~arm.grasped[1:]) + 1:
            since_s = motion.time_s - motion.time_s[let_go]
            found |= (since_s >= 0) & (since_s < _AFTER_RELEASE_S)
    return found


def _with_instants(motion: RecordedMotion, time_s: Floats) -> RecordedMotion:
    """``motion`` with further instants (m,), at which each arm is between its set-points and holds
    what it held at the last one."""
    known_s = motion.time_s
    near = np.abs(known_s[np.clip(np.searchsorted(known_s, time_s), 0, len(known_s) - 1)] - time_s)
    before = np.abs(known_s[np.clip(np.searchsorted(known_s, time_s) - 1, 0, None)] - time_s)
    new_s = time_s[(near > 1e-6) & (before > 1e-6)]
    if len(new_s) == 0:
        return motion
    all_s = np.union1d(known_s, new_s)
    last = np.clip(np.searchsorted(known_s, all_s + 1e-9, side="right") - 1, 0, None)
    inside = np.clip(all_s, known_s[0], known_s[-1])

    def between(arm: ArmMotion) -> ArmMotion:
        position = np.stack(
            [np.interp(inside, known_s, arm.position_m[:, k]) for k in range(3)], axis=1
        )
        turning = Slerp(known_s, Rotation.from_matrix(arm.rotation))
        return ArmMotion(position, turning(inside).as_matrix(), arm.grasped[last])

    return RecordedMotion(all_s, {name: between(arm) for name, arm in motion.arms.items()})
