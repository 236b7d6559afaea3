"""Another rival of every change of attachments: something that nobody knows of pulls at the tissue.

An instrument out of the picture, a neighbouring organ, a spot that is stiffer than believed: each
moves the tissue much as attachments would that are not there, or that are. What tells them apart is
that a hole holds with the force of a spring at rest, and anything else with any force it likes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from defras_bt.learning.estimate import Keyframe
from defras_bt.learning.hold_out import Split
from defras_bt.learning.linearised import Indices
from defras_bt.learning.misfit import Misfit, misfit
from defras_bt.learning.observed_cells import ObservedCells
from defras_bt.learning.replay import NotRepeatable, Replay
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.tissue.hole_response import HoleResponse
from defras_sim.tissue.state import TissueState

_RIDGE = 1e-3
"""Of the mean curvature: keeps a force from growing along a direction that the camera is blind
to."""
_LEAST = 1e-30
"""The same, where it sees nothing at all [m²/N²]."""
_FORCE = slice(0, 3)
"""Of the 9 numbers that a hole holds, the force; the others are moments."""


@dataclass(frozen=True)
class Pull:
    """The force at one place that explains the fitted cells best, anew in every fitted frame.

    ``residual_m`` (n,): signed distance that it leaves of the judging points of all frames, in
    their order; ``place_m`` (3,) at rest.
    """

    residual_m: Floats
    place_m: Floats


def best_pull(belief: Scene, keyframes: Sequence[Keyframe], replay: Replay, parts: Split) -> Pull:
    """The tissue answers linearly around what is believed; forces are tried at every other hole.
    Between the frames that are fitted they are interpolated in time.

    The tissue is thin: a force on its lower face moves the upper one as a force there would.
    Leaves ``replay`` with the shapes of the belief.

    Raises:
        NotRepeatable: the model cannot follow the motion, or the camera sees nothing of a shape.
    """
    stiffness = belief.hole_stiffness_n_per_m(belief.attached)
    shapes = replay.repeat(stiffness)
    holes = _every_other_hole(belief)
    left_m = np.zeros(len(holes))
    by_frame = []
    for frame, points in zip(parts.fitted, parts.fitted_points_m, strict=True):
        response = replay.response(frame, stiffness, holes)
        residual, jacobian = _cells(belief, shapes[frame], points, response)
        force = _least_squares(jacobian, residual)
        left_m += np.abs(residual + (jacobian @ force[:, :, None])[:, :, 0]).sum(axis=1)
        by_frame.append(force)
    best = int(np.argmin(left_m))
    fitted_s = [keyframes[frame].stamp_s for frame in parts.fitted]
    force_n = np.array([force[best] for force in by_frame])
    residuals = []
    for frame, points in enumerate(parts.judging_points_m):
        if len(points) == 0:
            continue
        response = replay.response(frame, stiffness, holes[best : best + 1])
        stamp_s = keyframes[frame].stamp_s
        now_n = np.array([np.interp(stamp_s, fitted_s, along) for along in force_n.T])
        residuals.append(_left_m(belief, shapes[frame], points, response, now_n))
    return Pull(np.concatenate(residuals), belief.holes_m[holes[best]])


def _every_other_hole(belief: Scene) -> Indices:
    """Like the black squares of a chess board; all holes where none lies on one."""
    columns, rows = belief.hole_counts
    black = np.add.outer(np.arange(rows), np.arange(columns)) % 2 == 1
    chosen = np.flatnonzero(belief.is_hole & black.ravel())
    return chosen if len(chosen) else np.flatnonzero(belief.is_hole)


def _cells(
    belief: Scene, shape: TissueState, points_m: Floats, response: HoleResponse
) -> tuple[Floats, Floats]:
    """Residuals (cells,) and their derivative (holes, cells, 3) by the forces."""
    cells = ObservedCells.of(points_m)
    compared = _compared(belief, shape, cells.points_m)
    jacobian = cells.jacobian(compared, _forces_of(response))
    return cells.residual_m(compared), np.moveaxis(jacobian, 1, 0)


def _left_m(
    belief: Scene, shape: TissueState, points_m: Floats, response: HoleResponse, force_n: Floats
) -> Floats:
    """Residuals (n,) of points with ``force_n`` (3,) at the one hole of ``response``."""
    compared = _compared(belief, shape, points_m)
    return compared.residual_m + compared.jacobian(response.surface_m_per_n[:, :, 0, _FORCE]) @ (
        force_n
    )


def _compared(belief: Scene, shape: TissueState, points_m: Floats) -> Misfit:
    compared = misfit(points_m, shape.surface, belief.depth_camera)
    if compared is None:
        raise NotRepeatable("the model's tissue leaves the depth camera's picture")
    return compared


def _forces_of(response: HoleResponse) -> HoleResponse:
    """Without the moments."""
    return HoleResponse(
        response.surface_m_per_n[..., _FORCE],
        response.holes_m_per_n[:, _FORCE][..., _FORCE],
        response.stretch_m[:, _FORCE],
    )


def _least_squares(jacobian: Floats, residual: Floats) -> Floats:
    """Force (holes, 3) at each hole alone, given (holes, cells, 3) and (cells,)."""
    normal = np.swapaxes(jacobian, 1, 2) @ jacobian
    mean = np.trace(normal, axis1=1, axis2=2) / 3.0
    # Where the camera sees nothing of what a force moves, there is none.
    ridge = np.maximum(_RIDGE * mean, _LEAST)
    normal = normal + ridge[:, None, None] * np.eye(3)
    pull = np.swapaxes(jacobian, 1, 2) @ residual
    return -np.asarray(np.linalg.solve(normal, pull[:, :, None]), float)[:, :, 0]
