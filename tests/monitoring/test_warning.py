"""Warning states over a sequence of ticks."""

from __future__ import annotations

import copy
from collections.abc import Callable

import numpy as np
import pytest

from defras_bt.monitoring.reading import MonitorReading
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


class TestMetricsThatCanWait:
    def readings(
        self, monitor: WarningMonitor, slab: Slab, take_cloud: Take, ticks: int, every: int
    ) -> list[MonitorReading]:
        """What is said in ticks of 50 ms; ``every`` so many brings a cloud of tissue that rises."""
        said = []
        for tick in range(ticks):
            frame, time = tick // every, 2.0 + 0.05 * tick
            stamp = 2.0 + 0.05 * every * frame
            cloud = PointCloud(stamp, take_cloud(slab(raised(4e-4 * frame)), frame))
            said.append(monitor.reading(cloud, slab(), time))
        return said

    def test_they_say_the_same_of_every_second_cloud(
        self, rested: WarningMonitor, slab: Slab, take_cloud: Take
    ) -> None:
        patient = copy.deepcopy(rested)
        patient.listen_to("local")
        at_once = self.readings(rested, slab, take_cloud, 60, every=2)
        later = self.readings(patient, slab, take_cloud, 60, every=2)
        for tick, (soon, late) in enumerate(zip(at_once, later, strict=True)):
            assert late.stamp_s == soon.stamp_s
            assert late.mu_m["local"] == soon.mu_m["local"]
            assert late.warning_state["local"] == soon.warning_state["local"]
            np.testing.assert_array_equal(late.per_point_m, soon.per_point_m)
            # The first cloud is compared at once. That of tick 2 is sampled in tick 3 and compared
            # in tick 5; the next one is that of tick 6.
            same = at_once[2 + (tick - 5) // 4 * 4 if tick >= 5 else 0]
            assert late.mu_m["median"] == same.mu_m["median"]
        assert later[-1].warning_state == at_once[-1].warning_state == {"local": 3, "median": 3}

    def test_rest_is_learned_as_well_one_tick_later(
        self, slab: Slab, take_cloud: Take, scene: Scene
    ) -> None:
        eager, patient = WarningMonitor(scene), WarningMonitor(scene)
        patient.listen_to("local")
        ready: dict[WarningMonitor, list[bool]] = {eager: [], patient: []}
        for tick in range(12):
            cloud = PointCloud(0.1 * (tick // 2), take_cloud(slab(), tick // 2))
            for monitor, said in ready.items():
                said.append(monitor.observe_rest(cloud, slab()))
        assert [said.index(True) for said in ready.values()] == [8, 9]
        assert str(patient.calibration) == str(eager.calibration)

    def test_they_are_heard_once_a_second_where_every_tick_brings_a_cloud(
        self, rested: WarningMonitor, slab: Slab, take_cloud: Take
    ) -> None:
        rested.listen_to("local")
        said = self.readings(rested, slab, take_cloud, 61, every=1)
        medians = [reading.mu_m["median"] for reading in said]
        changes = [tick for tick in range(1, 61) if medians[tick] != medians[tick - 1]]
        assert changes == [20, 40, 60]

    def test_the_metric_of_the_tree_and_the_local_one_never_wait(
        self, rested: WarningMonitor, slab: Slab, take_cloud: Take
    ) -> None:
        rested.listen_to("median")
        for reading in self.readings(rested, slab, take_cloud, 4, every=2)[::2]:
            assert len(reading.per_point_m) > 500
            assert not np.isnan(list(reading.mu_m.values())).any()
