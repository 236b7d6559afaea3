"""What the two metrics see and what they miss."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from defras_bt.monitoring.local import LocalMetric
from defras_bt.monitoring.median import MedianMetric
from defras_bt.monitoring.metric import Metric
from defras_bt.monitoring.seen import SeenSurface, seen_surface
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.surface import Surface

Slab = Callable[..., Surface]
Take = Callable[[Surface, int], Floats]
METRICS: tuple[Metric, ...] = (LocalMetric(), MedianMetric())


def rise_m(metric: Metric, cloud: Floats, rest: Floats, seen: SeenSurface) -> float:
    return metric.measure(cloud, seen).value_m - metric.measure(rest, seen).value_m


def test_local_is_near_the_noise_at_rest(slab: Slab, take_cloud: Take, scene: Scene) -> None:
    seen = seen_surface(slab(), scene.depth_camera)
    value = LocalMetric().measure(take_cloud(slab(), 0), seen).value_m
    assert 0.0002 < value < 0.0010


@pytest.mark.parametrize("metric", METRICS, ids=lambda metric: metric.name)
def test_another_noise_seed_changes_nothing(
    metric: Metric, slab: Slab, take_cloud: Take, scene: Scene
) -> None:
    seen = seen_surface(slab(), scene.depth_camera)
    assert abs(rise_m(metric, take_cloud(slab(), 1), take_cloud(slab(), 0), seen)) < 0.0003


def test_local_sees_a_bump_that_median_misses(
    slab: Slab, take_cloud: Take, scene: Scene, bump: Callable[..., object]
) -> None:
    seen = seen_surface(slab(), scene.depth_camera)
    rest = take_cloud(slab(), 0)
    bumped = take_cloud(slab(bump(0.01)), 1)
    assert rise_m(MedianMetric(), bumped, rest, seen) < 0.001
    assert rise_m(LocalMetric(), bumped, rest, seen) > 0.006


def test_local_sees_a_shift_by_the_slabs_own_thickness(
    slab: Slab, take_cloud: Take, scene: Scene
) -> None:
    seen = seen_surface(slab(lambda points: points + [0, 0, 0.005]), scene.depth_camera)
    value = LocalMetric().measure(take_cloud(slab(), 0), seen).value_m
    assert value == pytest.approx(0.005, abs=0.001)


def test_local_sees_bed_side_tissue_where_the_twin_has_a_flap_in_front(
    slab: Slab, take_cloud: Take, scene: Scene
) -> None:
    def lifted(points: Floats) -> Floats:
        lift = 0.8 * np.maximum(points[:, 0], 0.0)
        return points + np.column_stack([np.zeros((len(points), 2)), lift])

    seen = seen_surface(slab(lifted), scene.depth_camera)
    assert LocalMetric().measure(take_cloud(slab(), 0), seen).value_m > 0.02


@pytest.mark.parametrize("metric", METRICS, ids=lambda metric: metric.name)
def test_a_common_translation_changes_no_value(
    metric: Metric, slab: Slab, take_cloud: Take, scene: Scene, bump: Callable[..., object]
) -> None:
    seen = seen_surface(slab(), scene.depth_camera)
    cloud = take_cloud(slab(bump(0.01)), 3)
    shift = np.array([0.3, -0.2, 0.1])
    moved = SeenSurface(seen.triangles, seen.corners_m + shift, lambda: seen.samples_m + shift)
    expected = metric.measure(cloud, seen).value_m
    assert metric.measure(cloud + shift, moved).value_m == pytest.approx(expected, abs=1e-9)


def test_a_few_points_on_an_instrument_do_not_alarm(
    slab: Slab, take_cloud: Take, scene: Scene
) -> None:
    seen = seen_surface(slab(), scene.depth_camera)
    cloud = take_cloud(slab(), 0)
    before = LocalMetric().measure(cloud, seen).value_m
    cloud[::40] += [0.0, 0.0, 0.03]
    cloud[600:603] += [0.0, 0.0, 0.02]
    assert LocalMetric().measure(cloud, seen).value_m < before + 0.0005


@pytest.mark.parametrize("metric", METRICS, ids=lambda metric: metric.name)
def test_nothing_to_compare_is_nan(
    metric: Metric, slab: Slab, take_cloud: Take, scene: Scene
) -> None:
    seen = seen_surface(slab(), scene.depth_camera)
    assert np.isnan(metric.measure(np.zeros((0, 3)), seen).value_m)
    empty = SeenSurface(np.zeros(0, np.int64), np.zeros((0, 3, 3)), lambda: np.zeros((0, 3)))
    assert np.isnan(metric.measure(take_cloud(slab(), 0), empty).value_m)


def test_a_cloud_too_thin_to_show_a_local_mismatch_is_nan(
    slab: Slab, take_cloud: Take, scene: Scene
) -> None:
    seen = seen_surface(slab(), scene.depth_camera)
    assert np.isnan(LocalMetric().measure(take_cloud(slab(), 0)[::12], seen).value_m)
