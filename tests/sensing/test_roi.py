"""Visibility from a picture whose visible share is known."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.sensing.colours import DEFAULT_COLOURS
from defras_bt.sensing.roi import roi_visibility
from defras_sim.camera.pinhole import intrinsics, ray_directions, tissue_from_camera
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Attachments, Roi, Scene
from defras_sim.worlds.protocol import CameraImage

SCENE = Scene(
    name="region",
    attachments=Attachments(map=("#" * 12,) * 12),
    roi=Roi(center_x_m=0.01, center_y_m=-0.02),
)


def endoscope_picture(scene: Scene = SCENE) -> tuple[CameraImage, Floats]:
    """The unobstructed green disc on grey, and the bed point (h, w, 3) behind each pixel."""
    camera = scene.endoscope
    columns, rows = np.meshgrid(np.arange(camera.width_px), np.arange(camera.height_px))
    rays = ray_directions(camera, np.column_stack([columns.ravel(), rows.ravel()]).astype(float))
    origin = np.array(camera.position_m)
    bed = origin + rays * ((scene.roi_center_m[2] - origin[2]) / rays[:, 2])[:, None]
    disc = np.linalg.norm(bed - scene.roi_center_m, axis=1) <= scene.roi.radius_m
    rgb = np.where(disc[:, None], (40, 190, 70), (130, 130, 130)).astype(np.uint8)
    shape = (camera.height_px, camera.width_px, 3)
    image = CameraImage(
        0.0, rgb.reshape(shape), None, intrinsics(camera), tissue_from_camera(camera)
    )
    return image, bed.reshape(shape)


def test_the_bare_disc_is_fully_visible() -> None:
    image, _ = endoscope_picture()
    assert roi_visibility(image, SCENE, DEFAULT_COLOURS) == 1.0


@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 0.75])
def test_tissue_over_a_part_of_the_disc_hides_that_part(share: float) -> None:
    image, bed = endoscope_picture()
    offset = bed[..., 1] - SCENE.roi_center_m[1]
    rows = np.sort(offset[image.rgb[..., 1] == 190])
    covered = offset < (rows[int((1 - share) * (len(rows) - 1))] if share else np.inf)
    image.rgb[covered] = (200, 90, 80)
    assert roi_visibility(image, SCENE, DEFAULT_COLOURS) == pytest.approx(share, abs=0.02)


def test_green_elsewhere_exposes_nothing() -> None:
    image, bed = endoscope_picture()
    far = np.linalg.norm(bed[..., :2] - SCENE.roi_center_m[:2], axis=-1) > 0.02
    image.rgb[:] = (200, 90, 80)
    image.rgb[far] = (40, 190, 70)
    assert roi_visibility(image, SCENE, DEFAULT_COLOURS) == 0.0


def test_a_disc_beyond_the_picture_counts_as_hidden_there() -> None:
    image, _ = endoscope_picture()
    half = CameraImage(0.0, image.rgb[:, :100], None, image.intrinsics, image.tissue_from_camera)
    assert roi_visibility(half, SCENE, DEFAULT_COLOURS) < 0.05


def test_a_region_behind_the_camera_is_refused() -> None:
    image, _ = endoscope_picture()
    turned = Pose(np.array([0.2, 0.0, 0.1]), np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]]))
    away = CameraImage(0.0, image.rgb, None, image.intrinsics, turned)
    with pytest.raises(ValueError, match="not in front"):
        roi_visibility(away, SCENE, DEFAULT_COLOURS)
