"""Another rival of every change of attachments: something that nobody knows of pulls at the tissue.

An instrument out of the picture, a neighbouring organ, a spot that is stiffer than believed: each
moves the tissue much as attachments would that are not there, or that are. What tells them apart is
that a hole holds with the force of a spring at rest, and anything else with any force it likes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defras_bt.learning.hold_out import Split
from defras_bt.learning.linearised import Indices
from defras_bt.learning.misfit import misfit
from defras_bt.learning.observed_cells import ObservedCells
from defras_bt.learning.replay import NotRepeatable, Replay
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.tissue.hole_response import HoleResponse
from defras_sim.tissue.state import TissueState

_RIDGE = 1e-3
"""Of the mean curvature: keeps a force from growing along a direction that the camera is blind
to."""
_FORCE = slice(0, 3)
"""Of the 9 numbers that a hole holds, the force; the others are moments."""


@dataclass(frozen=True)
class Pull:
    """The force at one place that explains the fitted cells best, anew in every fitted frame.

    ``residual_m`` (n,): signed distance of the judging points of the fitted frames, in their order,
    that it leaves; ``place_m`` (3,) at rest.
    """

    residual_m: Floats
    place_m: Floats


def best_pull(belief: Scene, replay: Replay, parts: Split) -> Pull:
    """The tissue answers linearly around what is believed; forces are tried at every other hole.

    The tissue is thin: a force on its lower face moves the upper one as a force there would.
    Leaves ``replay`` with the shapes of the belief.

    Raises:
        NotRepeatable: the model cannot follow the motion, or the camera sees nothing of a shape.
    """
    stiffness = belief.hole_stiffness_n_per_m(belief.attached)
    shapes = replay.repeat(stiffness)
    holes = _every_other_hole(belief)
    fitted, judging = [], []
    for frame, points in zip(parts.fitted, parts.fitted_points_m, strict=True):
        response = replay.response(frame, stiffness, holes)
        fitted.append(_cells(belief, shapes[frame], points, response))
        judging.append(_points(belief, shapes[frame], parts.judging_points_m[frame], response))
    left_m = np.zeros(len(holes))
    forces = []
    for residual, jacobian in fitted:
        by_hole = np.moveaxis(jacobian, 1, 0)
        force = _least_squares(by_hole, residual)
        left_m += np.abs(residual + (by_hole @ force[:, :, None])[:, :, 0]).sum(axis=1)
        forces.append(force)
    best = int(np.argmin(left_m))
    residuals = [
        residual + jacobian[:, best] @ force[best]
        for (residual, jacobian), force in zip(judging, forces, strict=True)
    ]
    return Pull(np.concatenate(residuals), belief.holes_m[holes[best]])


def _every_other_hole(belief: Scene) -> Indices:
    """Like the black squares of a chess board."""
    columns, rows = belief.hole_counts
    black = np.add.outer(np.arange(rows), np.arange(columns)) % 2 == 1
    return np.flatnonzero(belief.is_hole & black.ravel())


def _cells(
    belief: Scene, shape: TissueState, points_m: Floats, response: HoleResponse
) -> tuple[Floats, Floats]:
    """Residuals (cells,) and their derivative (cells, holes, 3) by the forces."""
    cells = ObservedCells.of(points_m)
    compared = misfit(cells.points_m, shape.surface, belief.depth_camera)
    if compared is None:
        raise NotRepeatable("the model's tissue leaves the depth camera's picture")
    return cells.residual_m(compared), cells.jacobian(compared, _forces_of(response))


def _points(
    belief: Scene, shape: TissueState, points_m: Floats, response: HoleResponse
) -> tuple[Floats, Floats]:
    """As of cells, for each point by itself."""
    compared = misfit(points_m, shape.surface, belief.depth_camera)
    if compared is None:
        raise NotRepeatable("the model's tissue leaves the depth camera's picture")
    surface = _forces_of(response).surface_m_per_n
    flat = compared.jacobian(surface.reshape(*surface.shape[:2], -1))
    return compared.residual_m, flat.reshape(-1, *surface.shape[2:])


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
    normal = normal + _RIDGE * mean[:, None, None] * np.eye(3)
    pull = np.swapaxes(jacobian, 1, 2) @ residual
    return -np.asarray(np.linalg.solve(normal, pull[:, :, None]), float)[:, :, 0]
