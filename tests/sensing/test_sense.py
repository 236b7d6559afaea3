"""What passes through sensing, what is made from pictures, and what bad data turns into."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from defras_bt.sensing.sense import sense
from defras_sim.camera.pinhole import intrinsics, tissue_from_camera
from defras_sim.scene import Attachments, Roi, Scene
from defras_sim.worlds.protocol import CameraImage, Observation, PointCloud

SCENE = Scene(
    name="s", attachments=Attachments(map=("#" * 12,) * 12), roi=Roi(center_x_m=0, center_y_m=0)
)
POINTS = np.random.default_rng(0).uniform((-0.05, -0.05, 0.0), 0.05, (100, 3))


def ready_made() -> Observation:
    return Observation(
        2.0, {}, cloud=PointCloud(1.9, POINTS), roi_visibility=0.4, roi_visibility_stamp_s=1.9
    )


def picture(rgb: tuple[int, int, int], depth_m: float) -> CameraImage:
    camera = SCENE.depth_camera
    shape = (camera.height_px, camera.width_px)
    return CameraImage(
        1.95,
        np.full((*shape, 3), rgb, np.uint8),
        np.full(shape, depth_m),
        intrinsics(camera),
        tissue_from_camera(camera),
    )


SINGLE = POINTS.astype(np.float32).astype(float)
"""What a depth camera's numbers can hold."""


def test_what_was_sensed_already_stays_as_it_is() -> None:
    sensed = sense(replace(ready_made(), cloud=None), SCENE)
    assert sensed.faults
    assert sense(sensed, SCENE) is sensed


def test_ready_made_readings_pass_through_untouched() -> None:
    given = ready_made()
    sensed = sense(given, SCENE)
    assert sensed.cloud is not None
    assert sensed.cloud.stamp_s == given.cloud.stamp_s
    np.testing.assert_array_equal(sensed.cloud.points_m, SINGLE)
    assert (sensed.roi_visibility, sensed.roi_visibility_stamp_s) == (0.4, 1.9)
    assert sensed.faults == ()
    assert sensed.dropped_points == 0


def test_points_that_are_not_finite_are_dropped_and_counted() -> None:
    points = POINTS.copy()
    points[3, 1], points[7, 0] = np.nan, np.inf
    sensed = sense(replace(ready_made(), cloud=PointCloud(1.9, points)), SCENE)
    assert sensed.cloud is not None
    assert len(sensed.cloud.points_m) == 98
    assert sensed.cloud.stamp_s == 1.9
    assert sensed.dropped_points == 2


def test_a_useless_cloud_becomes_none_with_a_reason() -> None:
    for points in (np.zeros((0, 3)), np.full((50, 3), np.nan), POINTS[:5], np.zeros((9, 2))):
        sensed = sense(replace(ready_made(), cloud=PointCloud(1.9, points)), SCENE)
        assert sensed.cloud is None
        assert sensed.faults[0].startswith("no cloud: ")
    assert "2 not finite" not in sensed.faults[0]


def test_nothing_to_sense_from_is_said() -> None:
    sensed = sense(Observation(0.0, {}), SCENE)
    assert sensed.cloud is None
    assert sensed.roi_visibility is None
    assert len(sensed.faults) == 2


def test_pictures_become_cloud_and_visibility_with_the_pictures_stamps() -> None:
    seen = Observation(
        2.0,
        {},
        depth_image=picture((200, 90, 80), 0.26),
        endoscope_image=replace(picture((40, 190, 70), 0.2), depth_m=None),
    )
    sensed = sense(seen, SCENE)
    assert sensed.cloud is not None
    assert sensed.cloud.stamp_s == 1.95
    assert sensed.roi_visibility == 1.0
    assert sensed.roi_visibility_stamp_s == 1.95


def test_a_picture_without_tissue_gives_no_cloud() -> None:
    for image in (picture((120, 120, 120), 0.26), picture((200, 90, 80), np.nan)):
        sensed = sense(replace(ready_made(), cloud=None, depth_image=image), SCENE)
        assert sensed.cloud is None
        assert "0 usable points" in sensed.faults[0]


def test_an_impossible_visibility_is_not_believed() -> None:
    for value in (np.nan, 1.2, -0.1):
        sensed = sense(replace(ready_made(), roi_visibility=value), SCENE)
        assert sensed.roi_visibility is None
        assert sensed.roi_visibility_stamp_s is None
        assert "not between 0 and 1" in sensed.faults[0]


@pytest.mark.parametrize(
    ("changed", "share"),
    [
        (lambda m: 1e3 * m, "0%"),  # in millimetres
        (lambda m: tissue_from_camera(SCENE.depth_camera).inverse().apply(m), "0%"),
    ],
    ids=["millimetres", "camera frame"],
)
def test_a_cloud_of_another_unit_or_frame_is_no_cloud(changed, share) -> None:
    sensed = sense(replace(ready_made(), cloud=PointCloud(1.9, changed(POINTS))), SCENE)
    assert sensed.cloud is None
    assert f"only {share} of its points lie where tissue can be" in sensed.faults[-1]


def test_a_few_points_elsewhere_are_left_out() -> None:
    points = np.vstack([POINTS, np.full((10, 3), 0.3)])
    sensed = sense(replace(ready_made(), cloud=PointCloud(1.9, points)), SCENE)
    assert sensed.cloud is not None
    np.testing.assert_array_equal(sensed.cloud.points_m, SINGLE)
