"""Visible share of the region against areas of the disc."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from defras_sim.camera.ray_caster import RayCaster
from defras_sim.camera.visibility import roi_points_m, roi_visibility
from defras_sim.scene import Camera, Scene
from defras_sim.surface import Surface

PlaneMaker = Callable[..., Surface]


def test_region_sample_is_even_and_inside_the_disc(plain_scene: Scene) -> None:
    points = roi_points_m(plain_scene)
    radius = np.linalg.norm(points[:, :2], axis=1)
    assert radius.max() < plain_scene.roi.radius_m
    assert np.allclose(points[:, 2], -0.006)
    # On an even sample, the share inside radius r is (r / R)^2.
    for share in (0.25, 0.5, 0.75):
        assert np.mean(radius < np.sqrt(share) * plain_scene.roi.radius_m) == pytest.approx(
            share, abs=0.01
        )


def test_covered_region_is_hidden_and_a_bare_one_is_seen(
    plain_scene: Scene, plane: PlaneMaker
) -> None:
    over = RayCaster(plane())
    beside = RayCaster(plane(0.0, (0.03, -0.06), (0.06, 0.06)))
    assert roi_visibility(plain_scene, over) == 0.0
    assert roi_visibility(plain_scene, beside) == 1.0


@pytest.mark.parametrize("edge_x_m", [-0.0075, 0.0, 0.0075])
def test_half_occluded_disc_matches_the_circular_segment(
    edge_x_m: float, plain_scene: Scene, plane: PlaneMaker
) -> None:
    """A sheet just above the region, seen from far above, hides a segment of the disc."""
    above = Camera(position_m=(-0.001, 0.0, 3.0), target_m=(0.0, 0.0, 0.0))
    scene = plain_scene.model_copy(update={"endoscope": above})
    sheet = plane(-0.005, (edge_x_m, -0.06), (0.06, 0.06))
    ratio = edge_x_m / scene.roi.radius_m
    open_share = 1 - (np.arccos(ratio) - ratio * np.sqrt(1 - ratio**2)) / np.pi
    assert roi_visibility(scene, RayCaster(sheet)) == pytest.approx(open_share, abs=0.02)


def test_region_outside_the_picture_is_not_seen(plain_scene: Scene, plane: PlaneMaker) -> None:
    aside = Camera(position_m=(-0.17, 0.0, 0.12), target_m=(-0.3, 0.3, 0.0))
    nothing = RayCaster(plane(0.0, (1.0, 1.0), (1.1, 1.1)))
    assert roi_visibility(plain_scene.model_copy(update={"endoscope": aside}), nothing) == 0.0
