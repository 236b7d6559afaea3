"""ModelWorld: repeatable, still when told to be, honest about grip and force."""

from __future__ import annotations

import numpy as np
import pytest

from defras_sim.scene import Attachments, Roi, Scene
from defras_sim.worlds.jaw_contact import distance_to_upper_m
from defras_sim.worlds.model_world import ModelWorld
from defras_sim.worlds.protocol import (
    HOLD,
    JAW_CLOSED_RAD,
    JAW_OPEN_RAD,
    ArmCommand,
    Command,
    Observation,
)

RIGHT_SIDE = ("..........##",) * 12


@pytest.fixture
def scene() -> Scene:
    """Held along the largest x; a coarse mesh keeps the tests quick."""
    plain = Scene(
        name="right side",
        attachments=Attachments(map=RIGHT_SIDE),
        roi=Roi(center_x_m=0.01, center_y_m=0.0),
    )
    coarse = plain.simulation.model_copy(update={"elements_xyz": (5, 5, 1)})
    return plain.model_copy(update={"simulation": coarse})


def drive(world: ModelWorld, goal_m: tuple[float, float, float], speed_m_s: float = 0.1) -> None:
    """Move psm1's tip straight to a place."""
    for _ in range(200):
        here = world.observe().arms["psm1"].setpoint_tissue_from_tip.position_m
        way = np.asarray(goal_m) - here
        length = float(np.linalg.norm(way))
        if length < 1e-9:
            return
        velocity = way / length * min(speed_m_s, length / world.tick_s)
        world.command(Command({"psm1": ArmCommand(linear_m_s=velocity)}))
        world.step()
    raise AssertionError(f"never arrived at {goal_m}")


def turn_jaw(world: ModelWorld, jaw_rad: float) -> None:
    world.command(Command({"psm1": ArmCommand(jaw_rad=jaw_rad)}))
    for _ in range(8):
        world.step()


def retract(world: ModelWorld) -> list[Observation]:
    """Reach, grasp at the free edge, lift and let go."""
    seen = []
    drive(world, (-0.05, 0.02, 0.0))
    turn_jaw(world, JAW_OPEN_RAD)
    turn_jaw(world, JAW_CLOSED_RAD)
    seen.append(world.observe())
    drive(world, (-0.05, 0.02, 0.02), 0.04)
    seen.append(world.observe())
    turn_jaw(world, JAW_OPEN_RAD)
    seen.append(world.observe())
    return seen


def test_same_seed_same_run_other_seed_other_noise(scene: Scene) -> None:
    runs = [retract(ModelWorld(scene, np.random.default_rng(seed))) for seed in (3, 3, 4)]
    for one, same, other in zip(*runs, strict=True):
        assert one.cloud is not None
        assert same.cloud is not None
        assert other.cloud is not None
        assert np.array_equal(one.cloud.points_m, same.cloud.points_m)
        assert np.array_equal(
            one.arms["psm1"].tissue_from_tip.position_m,
            same.arms["psm1"].tissue_from_tip.position_m,
        )
        assert one.roi_visibility == same.roi_visibility == other.roi_visibility
        assert not np.array_equal(one.cloud.points_m, other.cloud.points_m)


def test_hold_means_no_motion(scene: Scene) -> None:
    world = ModelWorld(scene, np.random.default_rng(0))
    drive(world, (-0.05, 0.02, 0.0))
    turn_jaw(world, JAW_OPEN_RAD)
    turn_jaw(world, JAW_CLOSED_RAD)
    drive(world, (-0.05, 0.02, 0.01))
    before, tissue = world.observe(), world.true_surface().vertices_m
    world.command(HOLD)
    for _ in range(5):
        world.step()
    after = world.observe()
    for arm in ("psm1", "psm2"):
        assert np.array_equal(
            before.arms[arm].setpoint_tissue_from_tip.position_m,
            after.arms[arm].setpoint_tissue_from_tip.position_m,
        )
    assert np.array_equal(tissue, world.true_surface().vertices_m)


def test_a_command_ends_with_its_tick(scene: Scene) -> None:
    world = ModelWorld(scene, np.random.default_rng(0))
    start = world.observe().arms["psm1"].setpoint_tissue_from_tip.position_m
    world.command(Command({"psm1": ArmCommand(linear_m_s=np.array([0.0, 0.0, 0.1]))}))
    world.step()
    world.step()
    end = world.observe().arms["psm1"].setpoint_tissue_from_tip.position_m
    assert np.allclose(end - start, [0.0, 0.0, 0.1 * world.tick_s])


def test_grasp_lift_and_release(scene: Scene) -> None:
    world = ModelWorld(scene, np.random.default_rng(0))
    assert world.true_force_n() == 0.0
    assert world.observe().arms["psm1"].grasped is False
    drive(world, (-0.05, 0.02, 0.0))
    turn_jaw(world, JAW_OPEN_RAD)
    turn_jaw(world, JAW_CLOSED_RAD)
    assert world.observe().arms["psm1"].grasped is True
    drive(world, (-0.05, 0.02, 0.02))
    lifted = world.true_surface()
    assert world.true_force_n() > 0.001
    assert distance_to_upper_m(lifted, np.array([-0.05, 0.02, 0.02])) < 0.001
    turn_jaw(world, JAW_OPEN_RAD)
    assert world.observe().arms["psm1"].grasped is False
    assert world.true_force_n() == 0.0
    assert np.allclose(world.true_surface().vertices_m[:, 2].max(), 0.0, atol=1e-6)


def test_a_jaw_that_closes_above_the_tissue_takes_nothing(scene: Scene) -> None:
    world = ModelWorld(scene, np.random.default_rng(0))
    drive(world, (-0.05, 0.02, 0.006))
    turn_jaw(world, JAW_OPEN_RAD)
    turn_jaw(world, JAW_CLOSED_RAD)
    assert world.observe().arms["psm1"].grasped is False
    assert world.observe().arms["psm1"].jaw_rad == JAW_CLOSED_RAD


def test_sensors_come_at_their_own_rate_with_stamps(scene: Scene) -> None:
    slow = scene.endoscope.model_copy(update={"period_s": 0.15})
    world = ModelWorld(scene.model_copy(update={"endoscope": slow}), np.random.default_rng(0))
    clouds, pictures = [], []
    for tick in range(7):
        seen = world.observe()
        assert seen.time_s == pytest.approx(tick * 0.05)
        assert seen.arms["psm2"].stamp_s == seen.time_s
        assert seen is world.observe()
        assert seen.cloud is not None
        clouds.append(seen.cloud.stamp_s)
        pictures.append(seen.roi_visibility_stamp_s)
        world.step()
    assert clouds == pytest.approx([0, 0, 0.1, 0.1, 0.2, 0.2, 0.3])
    assert pictures == pytest.approx([0, 0, 0, 0.15, 0.15, 0.15, 0.3])


def test_the_cloud_lies_on_the_tissue_within_its_noise(scene: Scene) -> None:
    cloud = ModelWorld(scene, np.random.default_rng(0)).observe().cloud
    assert cloud is not None
    assert 1000 <= len(cloud.points_m) <= 1500
    upper = cloud.points_m[np.abs(cloud.points_m[:, 0]) < 0.055]
    # Noise of 0.5 mm along rays that come down at 50 degrees.
    assert np.std(upper[:, 2]) == pytest.approx(0.0005 * np.sin(np.arctan2(0.2, 0.17)), rel=0.1)


def test_bad_commands_are_refused(scene: Scene) -> None:
    world = ModelWorld(scene, np.random.default_rng(0))
    with pytest.raises(ValueError, match="this world has psm1, psm2"):
        world.command(Command({"psm3": ArmCommand()}))
    with pytest.raises(ValueError, match="not finite"):
        world.command(Command({"psm1": ArmCommand(linear_m_s=np.array([0.0, np.nan, 0.0]))}))


def test_a_closed_world_does_not_move(scene: Scene) -> None:
    world = ModelWorld(scene, np.random.default_rng(0))
    world.close()
    world.command(Command({"psm1": ArmCommand(linear_m_s=np.array([0.1, 0.0, 0.0]))}))
    world.step()
    tip = world.observe().arms["psm1"].setpoint_tissue_from_tip.position_m
    assert np.array_equal(tip, scene.arms["psm1"].home_tip_m)
