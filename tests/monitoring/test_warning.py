"""Warning states over a sequence of ticks."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from defras_bt.monitoring.seen import SeenSurface, seen_surface
from defras_bt.monitoring.warning import WarningMonitor
from defras_sim.geometry import Floats
from defras_sim.scene import Camera, Scene
from defras_sim.surface import Surface
from defras_sim.worlds.protocol import PointCloud

Slab = Callable[..., Surface]
Take = Callable[[Surface, int], Floats]


@pytest.fixture
def rested(slab: Slab, take_cloud: Take, scene: Scene) -> WarningMonitor:
    monitor = WarningMonitor(scene)
    for frame in range(10):
        monitor.observe_rest(PointCloud(0.1 * frame, take_cloud(slab(), frame)), slab())
    return monitor


def raised(height_m: float) -> Callable[[Floats], Floats]:
    return lambda points: points + [0.0, 0.0, height_m]


def test_rest_frames_raise_no_warning(rested: WarningMonitor, slab: Slab, take_cloud: Take) -> None:
    for frame in range(40):
        time = 2.0 + 0.1 * frame
        reading = rested.reading(PointCloud(time, take_cloud(slab(), 100 + frame)), slab(), time)
        assert reading.warning_state == {"local": 0, "median": 0}
        assert reading.mu_m["local"] < 0.0005
        assert reading.mu_m["median"] < 0.0005
    assert len(reading.per_point_m) > 500


@pytest.mark.parametrize(("height_mm", "state"), [(1, 0), (3, 1), (5, 2), (9, 3)])
def test_states_follow_the_thresholds(
    rested: WarningMonitor, slab: Slab, take_cloud: Take, height_mm: int, state: int
) -> None:
    shape = slab(raised(height_mm * 1e-3))
    for frame in range(2):
        time = 2.0 + 0.1 * frame
        reading = rested.reading(PointCloud(time, take_cloud(shape, frame)), slab(), time)
    assert reading.warning_state["local"] == state


def test_one_bad_frame_is_not_believed(
    rested: WarningMonitor, slab: Slab, take_cloud: Take
) -> None:
    heights = [0.0, 0.008, 0.0, 0.008, 0.008]
    states = []
    for frame, height in enumerate(heights):
        cloud = PointCloud(2.0 + 0.1 * frame, take_cloud(slab(raised(height)), frame))
        states.append(rested.reading(cloud, slab(), cloud.stamp_s).warning_state["local"])
    assert states == [0, 0, 0, 0, 3]


def test_a_cloud_seen_before_confirms_nothing(
    rested: WarningMonitor, slab: Slab, take_cloud: Take
) -> None:
    bad = PointCloud(2.0, take_cloud(slab(raised(0.008)), 1))
    first = rested.reading(bad, slab(), 2.0)
    assert rested.reading(bad, slab(), 2.05) is first
    assert first.warning_state["local"] == 0


def test_a_cloud_is_compared_with_the_twin_at_its_own_time(
    rested: WarningMonitor, slab: Slab, take_cloud: Take
) -> None:
    for tick in range(4):
        time = 2.0 + 0.05 * tick
        rested.reading(None, slab(raised(0.1 * (time - 2.0))), time)
    cloud = PointCloud(2.075, take_cloud(slab(raised(0.0075)), 1))
    reading = rested.reading(cloud, slab(raised(0.02)), 2.2)
    assert reading.mu_m["local"] < 0.0005


def test_without_a_cloud_mu_is_nan_and_the_state_stays(
    rested: WarningMonitor, slab: Slab, take_cloud: Take
) -> None:
    for frame in range(2):
        cloud = PointCloud(2.0 + 0.1 * frame, take_cloud(slab(raised(0.005)), frame))
        rested.reading(cloud, slab(), cloud.stamp_s)
    blind = rested.reading(None, slab(), 2.3)
    assert np.isnan(list(blind.mu_m.values())).all()
    assert blind.warning_state["local"] == 2
    thin = rested.reading(PointCloud(2.4, cloud.points_m[:3]), slab(), 2.4)
    assert np.isnan(thin.mu_m["local"])
    assert thin.warning_state["local"] == 2


def test_before_calibration_nothing_can_be_said(slab: Slab, take_cloud: Take, scene: Scene) -> None:
    monitor = WarningMonitor(scene)
    cloud = PointCloud(0.0, take_cloud(slab(), 0))
    assert np.isnan(monitor.reading(cloud, slab(), 0.0).mu_m["local"])
    assert not monitor.observe_rest(None, slab())
    ready = [monitor.observe_rest(cloud, slab()) for _ in range(10)]
    assert not any(ready)  # the same cloud over and over is one frame


def test_a_changed_twin_starts_with_a_clean_slate(
    rested: WarningMonitor, slab: Slab, take_cloud: Take
) -> None:
    shape = slab(raised(0.005))
    for frame in range(2):
        time = 2.0 + 0.1 * frame
        reading = rested.reading(PointCloud(time, take_cloud(shape, frame)), slab(), time)
    assert reading.warning_state["local"] == 2
    rested.twin_changed()
    reading = rested.reading(PointCloud(2.1, take_cloud(shape, 1)), shape, 2.1)
    assert reading.warning_state["local"] == 0
    assert reading.mu_m["local"] < 0.0005


def test_a_surface_that_did_not_change_is_looked_at_once(
    rested: WarningMonitor, slab: Slab, take_cloud: Take, monkeypatch: pytest.MonkeyPatch
) -> None:
    looked_at: list[Surface] = []

    def look(surface: Surface, camera: Camera) -> SeenSurface:
        looked_at.append(surface)
        return seen_surface(surface, camera)

    monkeypatch.setattr("defras_bt.monitoring.warning.seen_surface", look)
    still, moved = slab(), slab(raised(0.009))
    for tick, surface in enumerate([still, still, still, moved, moved]):
        time = 2.0 + 0.1 * tick
        reading = rested.reading(PointCloud(time, take_cloud(still, tick)), surface, time)
        assert (reading.mu_m["local"] > 0.006) == (surface is moved)
    assert [id(surface) for surface in looked_at] == [id(still), id(moved)]


class TestRelease:
    def warn(self, monitor: WarningMonitor, shape: Surface, rest: Surface, take, time_s: float):
        for late_s in (0.0, 0.1):
            cloud = PointCloud(time_s + late_s, take(shape, 7))
            reading = monitor.reading(cloud, rest, time_s + late_s)
        return reading

    def test_tissue_that_swings_back_raises_no_state(self, rested, slab, take_cloud) -> None:
        rested.tissue_released(2.0)
        reading = self.warn(rested, slab(raised(0.009)), slab(), take_cloud, 2.1)
        assert reading.warning_state["local"] == 0
        assert reading.mu_m["local"] > 0.006, "the discrepancy itself is told"

    def test_once_it_agreed_a_state_counts_again(self, rested, slab, take_cloud) -> None:
        rested.tissue_released(2.0)
        self.warn(rested, slab(), slab(), take_cloud, 2.1)
        reading = self.warn(rested, slab(raised(0.009)), slab(), take_cloud, 2.4)
        assert reading.warning_state["local"] == 3

    def test_what_is_still_off_after_five_seconds_counts(self, rested, slab, take_cloud) -> None:
        rested.tissue_released(2.0)
        reading = self.warn(rested, slab(raised(0.009)), slab(), take_cloud, 7.1)
        assert reading.warning_state["local"] == 3

    def test_a_new_grasp_ends_the_settling(self, rested, slab, take_cloud) -> None:
        rested.tissue_released(2.0)
        rested.tissue_grasped()
        reading = self.warn(rested, slab(raised(0.009)), slab(), take_cloud, 2.1)
        assert reading.warning_state["local"] == 3
