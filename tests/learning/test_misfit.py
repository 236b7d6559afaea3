"""Residuals of points against a simulated shape, and their derivative."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from defras_bt.learning.estimate import Keyframe
from defras_bt.learning.misfit import misfit
from defras_bt.learning.observed_cells import ObservedCells
from defras_bt.learning.replay import NotRepeatable, Replay
from defras_sim.geometry import Pose
from defras_sim.scene import Scene

Record = Callable[[int], list[Keyframe]]


def test_residuals_are_signed_and_measured_along_the_direction(
    truth: Scene, record: Record
) -> None:
    frame = record(1)[0]
    surface = Replay(truth, [frame], (4, 4, 1)).repeat(
        truth.hole_stiffness_n_per_m(truth.attached)
    )[0]
    inner = frame.cloud_m[np.abs(frame.cloud_m[:, :2]).max(axis=1) < 0.05].copy()
    for height in (0.003, -0.002):
        inner[:, 2] = height
        compared = misfit(inner, surface.surface, truth.depth_camera)
        assert compared is not None
        np.testing.assert_allclose(compared.residual_m, height, atol=1e-9)
        np.testing.assert_allclose(compared.direction, [[0, 0, 1]] * len(inner), atol=1e-6)


def test_the_derivative_by_hole_forces_agrees_with_small_springs(
    belief_without_patch: Scene, record: Record
) -> None:
    """Attaching a free hole softly pulls on it with stiffness times stretch."""
    frames = record(1)
    scene = belief_without_patch
    free = scene.hole_stiffness_n_per_m(scene.attached)
    replay = Replay(scene, frames, (6, 6, 1))
    state = replay.repeat(free)[-1]
    hole, soft = 5 * 12 + 8, 0.01
    response = replay.response(4, free, np.array([hole]))
    cells = ObservedCells.of(frames[4].cloud_m)
    compared = misfit(cells.points_m, state.surface, scene.depth_camera)
    assert compared is not None
    jacobian = cells.jacobian(compared, response)
    predicted = -soft * jacobian[:, 0] @ response.stretch_m[0]
    stiffer = free.copy()
    stiffer[hole] = soft
    shapes = replay.shapes(stiffer, [4])
    assert shapes is not None
    moved = shapes[0].surface.vertices_m - state.surface.vertices_m
    place = np.einsum("nk,nkd->nd", compared.weights, moved[compared.vertices])
    expected = cells.mean @ -np.einsum("nd,nd->n", place, compared.direction)
    scale = np.abs(expected).max()
    assert scale > 1e-5
    np.testing.assert_allclose(predicted, expected, atol=0.05 * scale)


def test_cells_average_and_drop_lonely_points() -> None:
    points = np.array([[0.001, 0.0, 0.0]] * 4 + [[0.05, 0.0, 0.0]] * 2)
    cells = ObservedCells.of(points)
    assert len(cells.points_m) == 4
    np.testing.assert_allclose(cells.mean.toarray(), [[0.25] * 4])


def test_a_grasp_off_the_tissue_cannot_be_repeated(truth: Scene, record: Record) -> None:
    frame = record(1)[0]
    above = Pose(np.array([0.0, 0.0, 0.05]))
    off = Keyframe(0.0, {"psm1": above}, {"psm1": above}, frame.cloud_m)
    with pytest.raises(NotRepeatable, match="grasp of psm1"):
        Replay(truth, [off], (4, 4, 1)).repeat(truth.hole_stiffness_n_per_m(truth.attached))
