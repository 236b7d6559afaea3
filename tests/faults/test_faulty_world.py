"""Every fault does to the world what its name says, from its start to its end, and tells when."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.executive.testing import bench_scene, flat_cloud_m
from defras_bt.faults.arms import (
    CommandsLost,
    GraspLost,
    JawStuck,
    Jumped,
    NotFollowing,
    Republished,
)
from defras_bt.faults.clouds import Displaced, Noisy, Repeated, Sparse, WrongFrame, WrongUnit
from defras_bt.faults.readings import (
    Delayed,
    Dropped,
    Duplicated,
    Frozen,
    Missing,
    NotANumber,
    OutOfOrder,
)
from defras_bt.faults.system import ClockStopped, LateTree, TwinDiverges, WorldLost
from defras_sim.camera.pinhole import tissue_from_camera
from defras_sim.worlds.error import WorldError
from defras_sim.worlds.protocol import ArmCommand, Command, Observation
from tests.faults.faulty_bench import UP, faulty, tripped, watch

MAX_AGE_S = bench_scene().thresholds.max_age_s
ONE_SECOND = {"start_s": 1.0, "duration_s": 1.0}
NOT_YET = {"start_s": 99.0}


def cloud_ages_s(seen: list[Observation]) -> np.ndarray:
    return np.array([o.time_s - o.cloud.stamp_s for o in seen])


def test_without_faults_nothing_changes() -> None:
    plain, wrapped = faulty(), faulty(Frozen(**NOT_YET), Jumped(**NOT_YET), LateTree(**NOT_YET))
    for one, other in zip(watch(plain, 2.0, UP), watch(wrapped, 2.0, UP), strict=True):
        assert one.time_s == other.time_s
        np.testing.assert_array_equal(one.cloud.points_m, other.cloud.points_m)
        np.testing.assert_array_equal(
            one.arms["psm1"].tissue_from_tip.position_m,
            other.arms["psm1"].tissue_from_tip.position_m,
        )
    assert tripped(wrapped) == []


def test_the_same_observation_comes_twice_if_no_time_passed() -> None:
    world = faulty(Noisy(), Dropped(probability=0.5))
    watch(world, 0.5)
    assert world.observe() is world.observe()


class TestMessages:
    """Ages of what arrives."""

    def test_frozen(self) -> None:
        world = faulty(Frozen(reading="camera", **ONE_SECOND))
        ages = cloud_ages_s(watch(world, 3.0))
        np.testing.assert_allclose(ages[:21], 0.0, atol=1e-9)
        np.testing.assert_allclose(ages[20:40], np.arange(20) * 0.05, atol=1e-9)
        np.testing.assert_allclose(ages[40:], 0.0, atol=1e-9)
        np.testing.assert_allclose(tripped(world), np.arange(1.55, 2.0, 0.05))

    def test_a_frozen_arm_leaves_the_camera_alone(self) -> None:
        seen = watch(faulty(Frozen(reading="psm1")), 1.0, UP)
        assert {o.arms["psm1"].stamp_s for o in seen} == {0.0}
        assert cloud_ages_s(seen).max() == 0.0

    def test_dropped_messages_leave_the_one_before(self) -> None:
        ages = cloud_ages_s(watch(faulty(Dropped(probability=0.5)), 50.0))
        lost = np.mean(ages > 0)
        assert 0.45 < lost < 0.55
        runs = np.round(ages / 0.05).astype(int)
        assert set(np.diff(runs)[np.diff(runs) > 0]) == {1}, "ages grow tick by tick"

    def test_delayed(self) -> None:
        ages = cloud_ages_s(watch(faulty(Delayed(delay_s=0.3)), 2.0))
        np.testing.assert_allclose(ages[6:], 0.3, atol=1e-9)

    def test_a_delay_beyond_what_may_be_acted_on(self) -> None:
        world = faulty(Delayed(delay_s=0.7, start_s=1.0))
        watch(world, 3.0)
        assert tripped(world)[0] == pytest.approx(0.95 + MAX_AGE_S + 0.05), "the last one in time"
        assert tripped(world)[-1] == 3.0

    @pytest.mark.parametrize(("fault", "age_s"), [(Duplicated, 0.05), (OutOfOrder, 0.2)])
    def test_twice_or_overtaken(self, fault, age_s) -> None:
        world = faulty(fault(start_s=1.0, probability=0.5))
        ages = np.round(cloud_ages_s(watch(world, 20.0)), 6)
        assert set(ages) == {0.0, age_s}
        assert tripped(world) == []

    @pytest.mark.parametrize("reading", ["cloud", "visibility", "camera", "psm1"])
    def test_missing_and_not_a_number(self, reading) -> None:
        for kind in (Missing, NotANumber):
            world = faulty(kind(reading=reading, **ONE_SECOND))
            seen = watch(world, 3.0)
            bad = [round(o.time_s, 6) for o in seen if _lacks(o, reading)]
            np.testing.assert_allclose(bad, np.arange(1.0, 2.0, 0.05))
            assert tripped(world) == bad


def _lacks(seen: Observation, reading: str) -> bool:
    if reading == "psm1":
        arm = seen.arms.get("psm1")
        return arm is None or bool(np.isnan(arm.tissue_from_tip.position_m).all())
    cloud_gone = seen.cloud is None or bool(np.isnan(seen.cloud.points_m).all())
    blind = seen.roi_visibility is None or bool(np.isnan(seen.roi_visibility))
    return {"cloud": cloud_gone, "visibility": blind, "camera": cloud_gone and blind}[reading]


class TestClouds:
    """Where the points of a flat cloud come to lie."""

    FLAT_M = flat_cloud_m()

    @pytest.mark.parametrize(
        ("fault", "expected_m"),
        [
            (WrongUnit(), 1e3 * FLAT_M),
            (WrongFrame(), tissue_from_camera(bench_scene().depth_camera).inverse().apply(FLAT_M)),
            (Displaced(offset_m=(0.0, 0.01, 0.02)), FLAT_M + [0.0, 0.01, 0.02]),
        ],
    )
    def test_changed_points(self, fault, expected_m) -> None:
        seen = watch(faulty(fault), 0.5)[-1]
        np.testing.assert_allclose(seen.cloud.points_m, expected_m, atol=1e-12)

    def test_sparse_points_are_some_of_the_true_ones(self) -> None:
        points_m = watch(faulty(Sparse(points=5)), 0.1)[-1].cloud.points_m
        assert len(points_m) == 5
        assert {tuple(p) for p in points_m} <= {tuple(p) for p in self.FLAT_M}

    def test_noise_is_as_large_as_told(self) -> None:
        seen = watch(faulty(Noisy(noise_sd_m=0.004)), 10.0)
        off_m = np.concatenate([o.cloud.points_m - self.FLAT_M for o in seen])
        assert off_m.std() == pytest.approx(0.004, rel=0.05)

    def test_a_repeat_looks_fresh_and_is_old(self) -> None:
        world = faulty(Repeated(**ONE_SECOND))
        seen = watch(world, 3.0)
        assert cloud_ages_s(seen).max() == 0.0
        np.testing.assert_allclose(tripped(world), np.arange(1.55, 2.0, 0.05))

    def test_a_displaced_cloud_counts_from_its_second_frame_on_and_only_while_tissue_is_held(
        self,
    ) -> None:
        free, holding = faulty(Displaced(start_s=1.0)), faulty(Displaced(start_s=1.0))
        holding._world.tools["psm1"].grasped = True
        for world in (free, holding):
            watch(world, 2.0)
        assert tripped(free) == []
        assert tripped(holding)[0] == pytest.approx(1.05)


class TestArms:
    """What tools do, and what is said of them."""

    def test_not_following(self) -> None:
        world = faulty(NotFollowing())
        seen = watch(world, 0.5, UP)
        arms = [o.arms["psm1"] for o in seen]
        assert len({tuple(arm.tissue_from_tip.position_m) for arm in arms}) == 1
        ahead_m = [
            arm.setpoint_tissue_from_tip.position_m[2] - arm.tissue_from_tip.position_m[2]
            for arm in arms
        ]
        np.testing.assert_allclose(ahead_m, 0.0025 * np.arange(11), atol=1e-12)
        assert tripped(world)[0] == pytest.approx(0.1), "5 mm away"

    def test_jumped(self) -> None:
        world = faulty(Jumped(offset_m=(0.0, 0.02, 0.0), **ONE_SECOND))
        seen = watch(world, 3.0)
        y_m = [o.arms["psm1"].tissue_from_tip.position_m[1] for o in seen]
        np.testing.assert_allclose(np.unique(np.round(np.diff(y_m), 6)), [-0.02, 0.0, 0.02])
        np.testing.assert_allclose(tripped(world), np.arange(1.0, 2.0, 0.05))

    def test_a_jaw_that_is_stuck_lets_the_tip_move(self) -> None:
        both = Command({"psm1": ArmCommand(np.array([0.0, 0.0, 0.05]), jaw_rad=0.8)})
        last = watch(faulty(JawStuck()), 1.0, both)[-1].arms["psm1"]
        assert last.jaw_rad == 0.0
        assert last.tissue_from_tip.position_m[2] == pytest.approx(0.06 + 0.05)

    def test_commands_that_are_lost_move_nothing(self) -> None:
        world = faulty(CommandsLost(arm="psm1"))
        seen = watch(world, 1.0, UP)
        assert len({tuple(o.arms["psm1"].tissue_from_tip.position_m) for o in seen}) == 1
        assert tripped(world)[0] == pytest.approx(0.1), "4.5 mm of 5 mm count as unexplained"

    def test_a_reading_that_is_republished_stays_with_new_stamps(self) -> None:
        world = faulty(Republished(arm="psm1", **ONE_SECOND))
        seen = watch(world, 3.0, UP)
        heights = [o.arms["psm1"].tissue_from_tip.position_m[2] for o in seen]
        assert len(set(heights[20:40])) == 1
        assert heights[40] == pytest.approx(heights[20] + 0.05)
        assert all(o.arms["psm1"].stamp_s == o.time_s for o in seen)
        np.testing.assert_allclose(tripped(world), np.arange(1.1, 1.999, 0.05))

    def test_tissue_slips_once(self) -> None:
        world = faulty(GraspLost(start_s=0.5))
        tool = world._world.tools["psm1"]
        tool.jaw_rad, tool.grasped = 0.15, True
        held = [o.arms["psm1"].grasped for o in watch(world, 1.5)]
        assert held[1:11] == [True] * 10, "the first was seen before it was held"
        assert held[11:] == [False] * 20
        tool.jaw_rad, tool.grasped = 0.15, True
        tool.jaw_goal_rad = 0.0
        assert all(o.arms["psm1"].grasped for o in watch(world, 1.0)[1:])


class TestWorld:
    """The world as a whole."""

    def test_a_stopped_clock_stops_every_stamp_of_the_arms_too(self) -> None:
        world = faulty(ClockStopped(**ONE_SECOND))
        seen = watch(world, 2.5)
        times = [o.time_s for o in seen]
        assert times[20:40] == [1.0] * 20
        assert times[40] == pytest.approx(2.0)
        assert all(o.arms["psm1"].stamp_s <= o.time_s for o in seen)
        assert tripped(world)[0] == pytest.approx(1.05)

    def test_a_lost_world_does_not_step(self) -> None:
        world = faulty(WorldLost(start_s=1.0))
        with pytest.raises(WorldError, match="lost"):
            watch(world, 2.0)
        assert world.time_s == pytest.approx(1.0)

    def test_time_runs_on_while_a_late_tree_thinks(self) -> None:
        world = faulty(LateTree(seconds=0.7, start_s=1.0))
        seen = watch(world, 1.5)
        assert world.time_s == pytest.approx(seen[-1].time_s + 0.7)
        assert tripped(world)[0] == pytest.approx(1.0)

    def test_faults_of_services_are_told_too(self) -> None:
        world = faulty(TwinDiverges(**ONE_SECOND))
        watch(world, 3.0)
        np.testing.assert_allclose(tripped(world), np.arange(1.0, 2.0, 0.05))

    def test_equal_seeds_give_equal_chance(self) -> None:
        def stamps(seed: int) -> list[float]:
            world = faulty(Dropped(probability=0.5), OutOfOrder(probability=0.3), seed=seed)
            return [o.cloud.stamp_s for o in watch(world, 5.0)]

        assert stamps(1) == stamps(1) != stamps(2)
