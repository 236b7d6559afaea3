"""What of a picture is tissue: against a rendered field whose parts are known."""

import numpy as np
import pytest

from defras_bt.dvrk.cameras.depth_pictures import cloud_of
from defras_bt.dvrk.cameras.point_cloud import ColouredCloud
from defras_bt.dvrk.cameras.tissue_cloud import TissueFilter
from defras_bt.dvrk.cameras.unusable import Unusable
from defras_bt.dvrk.stand_in.ray_pictures import RayPictures
from defras_bt.sensing.cloud import Workspace
from defras_bt.sensing.colours import DEFAULT_COLOURS
from defras_bt.sensing.roi import roi_visibility
from defras_sim.camera.pinhole import tissue_from_camera
from defras_sim.camera.ray_caster import RayCaster
from defras_sim.resources import resource
from defras_sim.scene import load_scene
from defras_sim.surface import Surface

SCENE = load_scene(resource("sim/scenes/demo.yaml"))
HALF_M = 0.06


def flat(height_m: float, low_x_m: float = -HALF_M) -> Surface:
    """A square of tissue at one height, from ``low_x_m`` on."""
    corners = [(low_x_m, -HALF_M), (HALF_M, -HALF_M), (HALF_M, HALF_M), (low_x_m, HALF_M)]
    return Surface(
        np.array([(x, y, height_m) for x, y in corners]),
        np.array([[0, 1, 2], [0, 2, 3]]),
        np.ones(4, bool),
        np.array(corners),
    )


def tissue_filter() -> TissueFilter:
    pose = tissue_from_camera(SCENE.depth_camera)
    return TissueFilter(pose, Workspace.of(SCENE), DEFAULT_COLOURS)


def test_only_tissue_is_taken_and_lies_where_it_is():
    eye = RayPictures(SCENE, SCENE.depth_camera)
    image = eye.take(RayCaster(flat(0.012)), 0.0, np.random.default_rng(0))
    points_m = tissue_filter().points_m(cloud_of(image.depth_m, image.rgb, image.intrinsics))
    assert 500 < len(points_m) < 1500
    assert np.abs(points_m[:, 2] - 0.012).max() < 0.003
    assert np.abs(points_m[:, :2]).max() < HALF_M + 0.002
    # Voxels of 4 mm keep a corner of the square from being thinned out.
    assert points_m[:, 0].min() < -HALF_M + 0.008


def test_without_rows_or_colours_less_is_known_and_still_tissue_is_found():
    eye = RayPictures(SCENE, SCENE.depth_camera)
    image = eye.take(RayCaster(flat(0.0)), 0.0, np.random.default_rng(0))
    cloud = cloud_of(image.depth_m, image.rgb, image.intrinsics)
    measured = np.isfinite(cloud.points[..., 2])
    loose = ColouredCloud(cloud.points[measured][None], cloud.rgb[measured][None])
    points_m = tissue_filter().points_m(loose)
    assert np.abs(points_m[:, 2]).max() < 0.004
    bare = tissue_filter().points_m(ColouredCloud(loose.points, None))
    assert len(bare) > len(points_m)


def test_millimetres_are_noticed():
    eye = RayPictures(SCENE, SCENE.depth_camera)
    image = eye.take(RayCaster(flat(0.0)), 0.0, np.random.default_rng(0))
    cloud = cloud_of(1e3 * image.depth_m, image.rgb, image.intrinsics)
    with pytest.raises(Unusable, match="millimetres"):
        tissue_filter().points_m(cloud)


def test_the_region_shows_in_a_rendered_picture_as_far_as_tissue_leaves_it():
    eye = RayPictures(SCENE, SCENE.endoscope)
    middle_m = float(SCENE.roi_center_m[0])
    shares = [
        roi_visibility(eye.take(RayCaster(surface), 0.0, None), SCENE, DEFAULT_COLOURS)
        for surface in (flat(0.0), flat(-0.0055, middle_m), flat(0.0, 0.059))
    ]
    assert shares[0] == 0.0
    assert shares[1] == pytest.approx(0.5, abs=0.08)
    assert shares[2] == pytest.approx(1.0, abs=0.03)
