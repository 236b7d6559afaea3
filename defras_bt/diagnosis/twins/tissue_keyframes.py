"""A few frames that stand for all of a trajectory, and the way back to all of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defras_bt.diagnosis.problem import Integers
from defras_bt.diagnosis.twins.tissue_phases import PHASES
from defras_bt.diagnosis.twins.tissue_trajectory import Trajectory
from defras_sim.geometry import Floats

KEYFRAMES = 20
_TIME_SHARE = 0.35
"""Of the spacing that goes by time; the rest goes by the way of the tips. What fades shows while
nothing moves."""


@dataclass(frozen=True)
class Keyframes:
    """``chosen`` (k,): indices of frames, increasing. ``grip`` (f,): frames of one number are held
    alike, and nothing is known of one from another."""

    chosen: Integers
    grip: Integers
    time_s: Floats

    def expanded(self, columns: Floats) -> Floats:
        """Columns (rows, k, p) at the keyframes, for every frame: (rows, f, p).

        Linear in time between keyframes of one grip; unknown ones (NaN) are bridged row by row.
        Frames of a grip without a keyframe, or a row without a value, do not change: zero.
        """
        rows, _, count = columns.shape
        found = np.zeros((rows, len(self.time_s), count))
        for grip in np.unique(self.grip):
            frames = np.flatnonzero(self.grip == grip)
            mine = np.flatnonzero(self.grip[self.chosen] == grip)
            if len(mine) == 0:
                continue
            known = np.isfinite(columns[:, mine]).all(axis=2)
            # Most rows are known at the same keyframes: each such pattern is one interpolation.
            for pattern in np.unique(known, axis=0):
                alike = (known == pattern).all(axis=1)
                if pattern.any():
                    at = mine[pattern]
                    weights = _weights(self.time_s[frames], self.time_s[self.chosen[at]])
                    values = np.einsum("fk,rkp->rfp", weights, columns[alike][:, at])
                    found[np.ix_(alike, frames)] = values
        return found


def keyframes(trajectory: Trajectory, count: int = KEYFRAMES) -> Keyframes:
    """About ``count`` frames, spread over the time and the way in which tissue is held."""
    motion, rows = trajectory.motion, trajectory.frames
    held = np.stack([arm.grasped[rows] for arm in motion.arms.values()])
    grip = np.concatenate([[0], np.cumsum(np.any(held[:, 1:] != held[:, :-1], axis=0))])
    busy = trajectory.phase != PHASES.index("rest")
    way = np.zeros(len(rows))
    for arm in motion.arms.values():
        gone = np.linalg.norm(np.diff(arm.position_m[rows], axis=0), axis=1)
        way[1:] += np.where(arm.grasped[rows][1:] & arm.grasped[rows][:-1], gone, 0.0)
    time_s = trajectory.time_s
    passed = np.where(busy, np.gradient(time_s), 0.0) if len(rows) > 1 else np.zeros(1)
    progress = np.cumsum(
        (1 - _TIME_SHARE) * way / max(float(way.sum()), 1e-12)
        + _TIME_SHARE * passed / max(float(passed.sum()), 1e-12)
    )
    edges = np.flatnonzero(np.diff(grip))
    wanted = np.searchsorted(progress, np.linspace(0, progress[-1], max(2, count)))
    # The first and the last frame of each grip, so that every frame lies between two.
    ends = np.concatenate([[0], edges, edges + 1, [len(rows) - 1]])
    chosen = np.unique(np.concatenate([np.clip(wanted, 0, len(rows) - 1), ends]))
    return Keyframes(chosen.astype(np.int64), grip.astype(np.int64), time_s)


def _weights(time_s: Floats, known_s: Floats) -> Floats:
    """Matrix (n, k) that interpolates linearly from times (k,) to times (n,), flat beyond them."""
    return np.stack([np.interp(time_s, known_s, unit) for unit in np.eye(len(known_s))], axis=1)
