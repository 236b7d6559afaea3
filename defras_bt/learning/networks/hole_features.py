"""What the sequence network is told: per hole and keyframe, how what was seen departs from what the
twin says, and what the twin says.

Lengths are in centimetres or millimetres and forces in units of the tissue's own stiffness, so that
all numbers are near one and nothing depends on the modulus, which shapes do not show.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from defras_bt.learning.estimate import Keyframe
from defras_bt.learning.misfit import misfit
from defras_bt.learning.networks.hole_grid import Spread, spread
from defras_bt.learning.prediction import Predicted
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.surface import Surface

FRAMES = 5
"""Keyframes that the network sees; of more, the newest and others spread over the motion."""

FRAME_CHANNELS = (
    "seen",
    "residual",
    "residual_size",
    "residual_rms",
    "gap_x",
    "gap_y",
    "gap_z",
    "rest_to_seen",
    "height_above",
    "points_above",
    "moved_x",
    "moved_y",
    "moved_z",
    "force_x",
    "force_y",
    "force_z",
    "force_share",
    "stretch",
    "tip_moved_x",
    "tip_moved_y",
    "tip_moved_z",
    "tip_x",
    "tip_y",
    "newest",
)
HOLE_CHANNELS = (
    "believed",
    "is_hole",
    "rim_x",
    "rim_y",
    "camera_x",
    "camera_y",
    "camera_z",
    "grasp_x",
    "grasp_y",
    "grasp_near",
    "thickness",
)

_CM, _MM = 1e2, 1e3
_FARTHEST_CM = 4.0


@dataclass(frozen=True)
class HoleFeatures:
    """``frames`` (f, holes, frame channels) in order of time, ``holes`` (holes, hole channels).

    ``grid`` is (rows, columns): holes are numbered row by row.
    """

    frames: Floats
    holes: Floats
    grid: tuple[int, int]


def hole_features(
    belief: Scene, keyframes: Sequence[Keyframe], predicted: Predicted
) -> HoleFeatures | None:
    """Features of the keyframes under ``belief``; None where the camera sees nothing of the twin.

    ``predicted`` has one shape per keyframe.
    """
    nx, ny = belief.hole_counts
    chosen = newest(len(keyframes))
    static = _Static.of(belief, predicted.rest)
    frames = []
    for place in chosen:
        found = _frame(
            belief,
            keyframes[place],
            predicted.surfaces[place],
            predicted.hole_forces_n[place],
            static,
            is_newest=place == chosen[-1],
        )
        if found is None:
            return None
        frames.append(found)
    return HoleFeatures(np.stack(frames), _holes(belief, keyframes[0]), (ny, nx))


def newest(count: int) -> list[int]:
    """Which of ``count`` keyframes the network sees: at most :data:`FRAMES`, the last included."""
    return np.unique(np.rint(np.linspace(0, count - 1, min(FRAMES, count)))).astype(int).tolist()


@dataclass(frozen=True)
class _Static:
    """What is the same in all keyframes: how the surface is shared out among the holes."""

    lower: Spread
    lower_vertices: NDArray[np.int64]
    rest: Surface
    upper_faces: NDArray[np.int64]
    faces: Spread
    upper_m: Floats

    @staticmethod
    def of(belief: Scene, rest: Surface) -> _Static:
        lower = np.flatnonzero(~rest.upper)
        upper_faces = rest.triangles[rest.upper[rest.triangles].all(axis=1)]
        return _Static(
            lower=spread(belief, rest.rest_xy_m[lower]),
            lower_vertices=lower,
            rest=rest,
            upper_faces=upper_faces,
            faces=spread(belief, rest.rest_xy_m[upper_faces].mean(axis=1)),
            upper_m=belief.tissue.shape.upper.at(belief.holes_xy_m),
        )


def _frame(
    belief: Scene,
    frame: Keyframe,
    surface: Surface,
    hole_forces_n: Floats,
    static: _Static,
    *,
    is_newest: bool,
) -> Floats | None:
    """Channels (holes, frame channels) of one keyframe."""
    compared = misfit(frame.cloud_m, surface, belief.depth_camera)
    if compared is None:
        return None
    count = len(belief.holes_xy_m)
    vertices = compared.vertices
    at_m = np.einsum("nk,nkd->nd", compared.weights, surface.rest_xy_m[vertices])
    near = spread(belief, at_m)
    residual = np.clip(_MM * compared.residual_m, -30.0, 30.0) / 3.0
    gap = residual[:, None] * compared.direction
    size = np.abs(residual)
    mean = near.mean(np.column_stack([residual, size, size**2, gap]))
    mean[:, 2] = np.sqrt(mean[:, 2])
    above = spread(belief, frame.cloud_m[:, :2])
    height = above.mean(frame.cloud_m[:, 2:])[:, 0] - static.upper_m[:, 2]
    height[above.total < 0.5] = 0.0
    away = cKDTree(frame.cloud_m).query(static.upper_m)[0]
    moved_m = (surface.vertices_m - static.rest.vertices_m)[static.lower_vertices]
    force = hole_forces_n / _force_unit_n(belief)
    strength = np.linalg.norm(force, axis=1)
    tip_m, way_m = _leading_tip(frame)
    columns = [
        np.log1p(near.total),
        mean,
        np.minimum(_CM * away, _FARTHEST_CM),
        np.clip(_CM * height, -_FARTHEST_CM, 2 * _FARTHEST_CM),
        np.log1p(above.total),
        _CM * static.lower.mean(moved_m),
        np.arcsinh(force),
        strength / max(float(strength.max(initial=0.0)), 1e-9),
        5.0 * static.faces.mean(_stretch(surface, static)[:, None]),
        np.tile(_CM * way_m / 3.0, (count, 1)),
        _CM * (tip_m[:2] - belief.holes_xy_m) / 5.0,
        np.full(count, float(is_newest)),
    ]
    return np.column_stack(columns)


def _holes(belief: Scene, first: Keyframe) -> Floats:
    """Channels (holes, hole channels) that do not change with the motion."""
    xy_m, is_hole = belief.holes_xy_m, belief.is_hole
    half_m = np.array([belief.tissue.length_x_m, belief.tissue.width_y_m]) / 2
    towards = np.array(belief.depth_camera.position_m) - belief.holes_m
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    taken = np.array([tip.position_m[:2] for tip in first.grasp_tips.values()])
    from_grasps = xy_m[:, None, :] - taken  # (holes, arms, 2)
    nearest = np.linalg.norm(from_grasps, axis=2).argmin(axis=1)
    from_grasp = from_grasps[np.arange(len(xy_m)), nearest]
    thickness_m = belief.tissue.shape.upper.at(xy_m)[:, 2] - belief.holes_m[:, 2]
    return np.column_stack(
        [
            belief.attached,
            is_hole,
            _CM * (half_m - np.abs(xy_m)) / 5.0,
            towards,
            _CM * from_grasp / 5.0,
            np.exp(-((np.linalg.norm(from_grasp, axis=1) / 0.02) ** 2)),
            np.where(is_hole, thickness_m, 0.0) / 0.005,
        ]
    )


def _stretch(surface: Surface, static: _Static) -> Floats:
    """Largest strain (faces,) of an edge of each triangle of the upper face."""
    lengths = []
    for vertices_m in (surface.vertices_m, static.rest.vertices_m):
        corners = vertices_m[static.upper_faces]
        lengths.append(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2))
    return np.asarray((lengths[0] / np.maximum(lengths[1], 1e-9) - 1.0).max(axis=1))


def _leading_tip(frame: Keyframe) -> tuple[Floats, Floats]:
    """Where the tip is (3,) that has moved most since its grasp, and how far (3,) it has."""
    ways = {
        arm: tip.position_m - frame.grasp_tips[arm].position_m for arm, tip in frame.tips.items()
    }
    arm = max(ways, key=lambda name: float(np.linalg.norm(ways[name])))
    return frame.tips[arm].position_m, ways[arm]


def _force_unit_n(belief: Scene) -> float:
    """A tenth of the modulus on the cross-section of a strip as wide as the holes are apart."""
    tissue = belief.tissue
    return 0.1 * tissue.young_modulus_pa * tissue.thickness_m * belief.attachments.hole_pitch_m
