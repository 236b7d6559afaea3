"""Which observed points are fitted and which judge the fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defras_bt.learning.estimate import Keyframe
from defras_sim.geometry import Floats

CELL_M = 0.01


@dataclass(frozen=True)
class Cells:
    """The 10 mm cubes of a three-dimensional chess board that points (n, 3) lie in.

    ``key`` (n,) numbers the cube; ``black`` (n,) marks every other one. Residuals of neighbouring
    points are alike, so a point next to a fitted one would judge nothing: whole cubes are held out.
    """

    key: NDArray[np.int64]
    black: NDArray[np.bool_]

    @staticmethod
    def of(points_m: Floats) -> Cells:
        index = np.floor(np.asarray(points_m) / CELL_M).astype(np.int64)
        shifted = index + 1000  # cubes within 10 m of the origin
        key = (shifted[:, 0] * 2001 + shifted[:, 1]) * 2001 + shifted[:, 2]
        return Cells(key, index.sum(axis=1) % 2 == 0)


@dataclass(frozen=True)
class Split:
    """``fitted``: frames whose black cubes are fitted; ``judging``: the points (n, 3) per frame
    that judge the result: white cubes of fitted frames, everything of the others."""

    fitted: tuple[int, ...]
    fitted_points_m: tuple[Floats, ...]
    judging_points_m: tuple[Floats, ...]


def split(keyframes: Sequence[Keyframe], most_fitted: int, least_travel_m: float) -> Split:
    """Fit the newest frame, which shows most, and others spread over the motion.

    The second newest is held out as a whole where there are three or more: a shape near the
    largest deformation, which is where the model will be used. Frames in which no tip is farther
    than ``least_travel_m`` from its grasp show nothing; they are neither fitted nor judging.
    """
    useful = [i for i, frame in enumerate(keyframes) if travel_m(frame) >= least_travel_m]
    candidates = useful[:-2] + useful[-1:] if len(useful) >= 3 else useful
    spread = np.linspace(0, len(candidates) - 1, min(most_fitted, len(candidates)))
    fitted = tuple(candidates[int(np.ceil(place - 1e-9))] for place in spread)
    fitted_points, judging_points = [], []
    for index, frame in enumerate(keyframes):
        black = Cells.of(frame.cloud_m).black
        if index in fitted:
            fitted_points.append(frame.cloud_m[black])
            judging_points.append(frame.cloud_m[~black])
        else:
            judging_points.append(frame.cloud_m[slice(None) if index in useful else slice(0)])
    return Split(fitted, tuple(fitted_points), tuple(judging_points))


def travel_m(frame: Keyframe) -> float:
    """How far the tip that moved most is from where it took the tissue."""
    return max(
        float(np.linalg.norm(tip.position_m - frame.grasp_tips[arm].position_m))
        for arm, tip in frame.tips.items()
    )
