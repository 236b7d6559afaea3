"""What networks are told: shared out without loss, blind to left and right, empty where nothing
departs from the prediction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import torch

from defras_bt.learning.estimate import Keyframe
from defras_bt.learning.networks.hole_features import (
    FRAME_CHANNELS,
    HOLE_CHANNELS,
    HoleFeatures,
    hole_features,
    newest,
)
from defras_bt.learning.networks.hole_grid import spread
from defras_bt.learning.networks.symmetry import mirrored
from defras_bt.learning.networks.voxels import VOXELS, VoxelBox, corners_of_holes, voxel_inputs
from defras_bt.learning.prediction import Predicted
from defras_bt.learning.replay import Replay
from defras_sim.scene import Scene

Record = Callable[[int], list[Keyframe]]


@pytest.fixture(scope="module")
def frames(record: Record) -> list[Keyframe]:
    return record(1)[2:]


def predicted(scene: Scene, frames: list[Keyframe]) -> Predicted:
    replay = Replay(scene, frames)
    states = replay.repeat(scene.hole_stiffness_n_per_m(scene.attached))
    return Predicted.of(replay.rest_surface, states)


def channel(features: HoleFeatures, name: str) -> np.ndarray:
    """Of the newest frame (rows, columns)."""
    return features.frames[-1, :, FRAME_CHANNELS.index(name)].reshape(features.grid)


def test_shares_of_places_within_the_grid_sum_to_one(truth: Scene) -> None:
    rng = np.random.default_rng(0)
    xy_m = rng.uniform(-0.054, 0.054, (500, 2))
    shared = spread(truth, xy_m)
    assert shared.total.sum() == pytest.approx(500)
    # What is linear over the tissue is met exactly in the mean.
    mean = shared.sum(xy_m).sum(axis=0) / 500
    np.testing.assert_allclose(mean, xy_m.mean(axis=0), atol=1e-12)
    at_holes = spread(truth, truth.holes_xy_m)
    np.testing.assert_allclose(at_holes.mean(truth.holes_xy_m), truth.holes_xy_m, atol=1e-12)


def test_residuals_show_where_the_belief_is_wrong(
    truth: Scene, belief_without_patch: Scene, frames: list[Keyframe]
) -> None:
    right = hole_features(truth, frames, predicted(truth, frames))
    wrong = hole_features(belief_without_patch, frames, predicted(belief_without_patch, frames))
    assert right is not None
    assert wrong is not None
    assert right.frames.shape == (3, 144, len(FRAME_CHANNELS))
    assert right.holes.shape == (144, len(HOLE_CHANNELS))
    assert np.isfinite(wrong.frames).all()
    size = channel(wrong, "residual_size") - channel(right, "residual_size")
    row, column = np.unravel_index(np.argmax(size), size.shape)
    patch = (truth.attached & ~belief_without_patch.attached).reshape(right.grid)
    rows, columns = np.nonzero(patch)
    assert rows.min() - 2 <= row <= rows.max() + 2
    assert columns.min() - 2 <= column <= columns.max() + 3
    # Tissue that is held lies lower than a twin without the patch has it.
    assert channel(wrong, "residual")[row, column] < 0


def test_a_stiffer_tissue_of_the_same_shape_gives_the_same_features(
    truth: Scene, frames: list[Keyframe]
) -> None:
    stiffer = truth.model_copy(
        update={"tissue": truth.tissue.model_copy(update={"young_modulus_pa": 6000.0})}
    )
    one = predicted(truth, frames)
    other = replace(one, hole_forces_n=tuple(2 * force for force in one.hole_forces_n))
    soft, stiff = hole_features(truth, frames, one), hole_features(stiffer, frames, other)
    assert soft is not None
    assert stiff is not None
    np.testing.assert_allclose(soft.frames, stiff.frames, atol=1e-12)


def test_a_cloud_that_nothing_can_be_compared_with_gives_nothing(
    truth: Scene, frames: list[Keyframe]
) -> None:
    away = truth.depth_camera.model_copy(update={"target_m": (5.0, 0.0, 0.2)})
    blind = truth.model_copy(update={"depth_camera": away})
    assert hole_features(blind, frames, predicted(truth, frames)) is None


@pytest.mark.parametrize(("count", "wanted"), [(1, [0]), (3, [0, 1, 2]), (9, [0, 2, 4, 6, 8])])
def test_the_newest_frame_is_always_seen(count: int, wanted: list[int]) -> None:
    assert newest(count) == wanted


@pytest.mark.parametrize("turn", [{"x": True}, {"y": True}, {"swap": True}])
def test_mirrored_features_are_those_of_mirrored_tissue(turn: dict[str, bool]) -> None:
    """Twice the same mirror is nothing, and vectors turn with the grid."""
    rng = np.random.default_rng(3)
    frames = torch.from_numpy(rng.normal(size=(2, 5, len(FRAME_CHANNELS), 6, 6)))
    holes = torch.from_numpy(rng.normal(size=(2, len(HOLE_CHANNELS), 6, 6)))
    labels = torch.from_numpy(rng.normal(size=(2, 6, 6)))
    about = {"x": False, "y": False, "swap": False, **turn}
    once = mirrored(frames, holes, labels, **about)
    twice = mirrored(*once, **about)
    for before, after in zip((frames, holes, labels), twice, strict=True):
        torch.testing.assert_close(before, after)
    x, y = FRAME_CHANNELS.index("gap_x"), FRAME_CHANNELS.index("gap_y")
    if turn == {"x": True}:
        torch.testing.assert_close(once[0][:, :, x], -frames[:, :, x].flip(-1))
        torch.testing.assert_close(once[0][:, :, y], frames[:, :, y].flip(-1))
    if turn == {"swap": True}:
        torch.testing.assert_close(once[0][:, :, x], frames[:, :, y].transpose(-1, -2))


def test_voxels_hold_the_faces_at_rest_and_the_points_seen(
    truth: Scene, frames: list[Keyframe]
) -> None:
    channels = voxel_inputs(truth, frames[-1].cloud_m)
    assert channels.shape == (3, *VOXELS)
    assert channels.min() >= 0
    assert channels.max() <= 1
    box = VoxelBox.around(truth)
    heights = box.centres_m[12, 12, :, 2]
    nearest = np.argmin(np.abs(heights + truth.tissue.thickness_m))
    assert np.argmax(channels[1, 12, 12]) == nearest
    # Where the tip has lifted the tissue, points are seen high above the upper face.
    tip_m = frames[-1].tips["psm1"].position_m
    x, y, z = np.rint(box.coordinates(tip_m[None])[0]).astype(int)
    assert channels[2, x - 1 : x + 2, y - 1 : y + 2, z - 1 : z + 2].max() > 0.5
    assert channels[0, x, y, z] < 0.2


def test_values_at_holes_are_interpolated_linearly(truth: Scene) -> None:
    corners, weights = corners_of_holes(truth)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    centres = VoxelBox.around(truth).centres_m.reshape(-1, 3)
    met = np.einsum("hk,hkd->hd", weights, centres[corners])
    np.testing.assert_allclose(met, truth.holes_m, atol=1e-9)
