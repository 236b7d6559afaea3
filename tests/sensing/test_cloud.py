"""Clouds from depth pictures of shapes whose answer is known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.sensing.cloud import (
    VOXEL_M,
    Workspace,
    decimate_m,
    tissue_pixels,
    tissue_points_m,
)
from defras_bt.sensing.colours import DEFAULT_COLOURS
from defras_sim.camera.pinhole import intrinsics, ray_directions, tissue_from_camera
from defras_sim.scene import Attachments, Roi, Scene
from defras_sim.worlds.protocol import CameraImage

SCENE = Scene(
    name="flat",
    attachments=Attachments(map=("#" * 12,) * 12),
    roi=Roi(center_x_m=0.0, center_y_m=0.0),
)
TISSUE_RGB, GREY_RGB = (200, 90, 80), (120, 120, 125)


def picture_of_plane(height_m: float = 0.0, slope: float = 0.0) -> CameraImage:
    """A 120 x 120 mm tissue on the plane z = height + slope x, a grey table around it."""
    camera = SCENE.depth_camera
    columns, rows = np.meshgrid(np.arange(camera.width_px), np.arange(camera.height_px))
    pixels = np.column_stack([columns.ravel(), rows.ravel()]).astype(float)
    rays = ray_directions(camera, pixels)
    origin = np.array(camera.position_m)
    depth = (height_m + slope * origin[0] - origin[2]) / (rays[:, 2] - slope * rays[:, 0])
    hit = origin + rays * depth[:, None]
    tissue = (np.abs(hit[:, :2]) <= 0.06).all(axis=1)
    rgb = np.where(tissue[:, None], TISSUE_RGB, GREY_RGB).astype(np.uint8)
    shape = (camera.height_px, camera.width_px)
    return CameraImage(
        1.0,
        rgb.reshape(*shape, 3),
        np.where(depth > 0, depth, np.nan).reshape(shape),
        intrinsics(camera),
        tissue_from_camera(camera),
    )


@pytest.mark.parametrize(("height_m", "slope"), [(0.0, 0.0), (0.01, 0.0), (0.0, 0.2)])
def test_points_lie_on_the_plane_that_was_rendered(height_m: float, slope: float) -> None:
    points = tissue_points_m(picture_of_plane(height_m, slope), SCENE, DEFAULT_COLOURS)
    np.testing.assert_allclose(points[:, 2], height_m + slope * points[:, 0], atol=1e-9)
    assert np.abs(points[:, :2]).max() < 0.06


def test_about_a_thousand_points_cover_the_tissue_evenly() -> None:
    points = tissue_points_m(picture_of_plane(), SCENE, DEFAULT_COLOURS)
    assert 700 <= len(points) <= 1300
    assert np.ptp(points[:, 0]) > 0.11
    assert np.ptp(points[:, 1]) > 0.11


def test_an_instrument_and_a_margin_around_it_are_left_out() -> None:
    image = picture_of_plane()
    assert image.depth_m is not None
    image.rgb[100:140, 150:160] = GREY_RGB
    image.depth_m[100:140, 150:160] -= 0.05
    image.depth_m[99, 150:160] -= 0.02  # flying pixels: tissue colour, in-between depth
    image.depth_m[140, 150:160] -= 0.02
    pixels = tissue_pixels(image.rgb, image.depth_m, DEFAULT_COLOURS)
    assert not pixels[98:142, 148:162].any()
    assert pixels[94, 140]
    assert pixels[120, 146]
    points = tissue_points_m(image, SCENE, DEFAULT_COLOURS)
    np.testing.assert_allclose(points[:, 2], 0.0, atol=1e-9)


def test_pixels_at_a_depth_edge_between_two_folds_are_left_out() -> None:
    image = picture_of_plane()
    assert image.depth_m is not None
    image.depth_m[:, :160] -= 0.015
    pixels = tissue_pixels(image.rgb, image.depth_m, DEFAULT_COLOURS)
    assert not pixels[:, 159:161].any()
    assert pixels[120, 157]
    assert pixels[120, 162]


def test_pixels_without_depth_are_left_out() -> None:
    image = picture_of_plane()
    assert image.depth_m is not None
    image.depth_m[90:150, 100:200] = np.nan
    pixels = tissue_pixels(image.rgb, image.depth_m, DEFAULT_COLOURS)
    assert not pixels[90:150, 100:200].any()
    assert np.isfinite(tissue_points_m(image, SCENE, DEFAULT_COLOURS)).all()


def test_points_outside_the_workspace_are_cut() -> None:
    box = Workspace.of(SCENE)
    points = np.array([[0.0, 0, 0], [0.3, 0, 0], [0, 0, -0.1], [0, 0, np.nan]])
    np.testing.assert_array_equal(box.holds(points), [True, False, False, False])


def test_decimation_keeps_the_shape_and_any_order_gives_the_same() -> None:
    rng = np.random.default_rng(3)
    points = rng.uniform(-0.05, 0.05, (20_000, 3)) * [1, 1, 0]
    few = decimate_m(points, VOXEL_M)
    assert len(few) == 25 * 25
    np.testing.assert_allclose(few, decimate_m(rng.permutation(points), VOXEL_M), atol=1e-12)
    assert decimate_m(np.zeros((0, 3)), VOXEL_M).shape == (0, 3)


def test_a_picture_without_depth_is_refused() -> None:
    image = picture_of_plane()
    blind = CameraImage(0.0, image.rgb, None, image.intrinsics, image.tissue_from_camera)
    with pytest.raises(ValueError, match="no depth_m"):
        tissue_points_m(blind, SCENE, DEFAULT_COLOURS)
