"""The depth camera against a plane."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import pytest

from defras_sim.camera.depth import depth_cloud_m
from defras_sim.camera.ray_caster import RayCaster
from defras_sim.camera.visibility import roi_visibility
from defras_sim.scene import Camera, Scene
from defras_sim.surface import Surface

PlaneMaker = Callable[..., Surface]


def test_cloud_lies_on_the_plane_and_covers_it(camera: Camera, plane: PlaneMaker) -> None:
    surface = plane()
    cloud = depth_cloud_m(camera, surface, RayCaster(surface), np.random.default_rng(0))
    assert 1000 <= len(cloud) <= 1800
    assert np.abs(cloud[:, 2]).max() < 1e-6
    assert cloud[:, :2].min() < -0.055
    assert cloud[:, :2].max() > 0.055


def test_noise_acts_along_the_ray(camera: Camera, plane: PlaneMaker) -> None:
    surface = plane()
    noisy = camera.model_copy(update={"noise_sd_m": 0.001})
    caster = RayCaster(surface)
    clean_cloud = depth_cloud_m(camera, surface, caster, np.random.default_rng(0))
    cloud = depth_cloud_m(noisy, surface, caster, np.random.default_rng(0))
    origin = np.array(camera.position_m)
    away, clean_away = (np.linalg.norm(c - origin, axis=1) for c in (cloud, clean_cloud))
    assert np.std(away - clean_away) == pytest.approx(0.001, rel=0.1)
    directions = (cloud - origin) / away[:, None]
    assert np.allclose(directions, (clean_cloud - origin) / clean_away[:, None])


def test_tissue_out_of_the_picture_gives_an_empty_cloud(camera: Camera, plane: PlaneMaker) -> None:
    for where in (5.0, -5.0):
        surface = plane(0.0, (where, where), (where + 0.1, where + 0.1))
        cloud = depth_cloud_m(camera, surface, RayCaster(surface), np.random.default_rng(0))
        assert cloud.shape == (0, 3)


def test_a_frame_takes_few_milliseconds(
    plain_scene: Scene, camera: Camera, plane: PlaneMaker
) -> None:
    surface = plane()
    rng = np.random.default_rng(0)
    times = []
    for _ in range(10):
        start = time.perf_counter()
        caster = RayCaster(surface)
        depth_cloud_m(camera, surface, caster, rng)
        roi_visibility(plain_scene, caster)
        times.append(time.perf_counter() - start)
    # About 3 ms alone on one core. The quickest says what a frame takes; the others, what else ran.
    assert min(times) < 0.05
