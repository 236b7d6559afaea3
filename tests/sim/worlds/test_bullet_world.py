"""BulletWorld: arms, jaw, tissue and pictures of one short retraction, looked at many times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from defras_bt.sensing.sense import sense
from defras_sim.resources import resource
from defras_sim.scene import Scene, load_scene
from defras_sim.twin import Twin
from defras_sim.worlds.bullet_world import BulletWorld
from defras_sim.worlds.error import WorldError
from defras_sim.worlds.protocol import (
    JAW_CLOSED_RAD,
    JAW_OPEN_RAD,
    ArmCommand,
    Command,
    Observation,
)

ARM = "psm1"
POINT = (1, 3)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene(resource("sim/scenes/demo_actual.yaml"))


def go(world: BulletWorld, target_m: np.ndarray, speed_m_s: float = 0.05) -> None:
    for _ in range(400):
        now_m = world.observe().arms[ARM].setpoint_tissue_from_tip.position_m
        way = target_m - now_m
        length = float(np.linalg.norm(way))
        if length < 1e-6:
            return
        speed = min(speed_m_s, length / world.tick_s)
        world.command(Command({ARM: ArmCommand(linear_m_s=way * (speed / length))}))
        world.step()
    raise AssertionError(f"the set-point did not reach {target_m}")


def turn_jaw(world: BulletWorld, jaw_rad: float) -> None:
    for _ in range(8):
        world.command(Command({ARM: ArmCommand(jaw_rad=jaw_rad)}))
        world.step()


@dataclass
class Story:
    """What was seen at each stage of one retraction."""

    world: BulletWorld
    start: Observation
    grasped: Observation
    lifted: Observation
    force_n: float
    lag_m: float
    twin: Twin


@pytest.fixture(scope="module")
def story(scene: Scene):
    world = BulletWorld(scene, np.random.default_rng(0))
    start = world.observe()
    at_m = np.array([*scene.grasp_xy_m(*POINT), 0.0])
    turn_jaw(world, JAW_OPEN_RAD)
    go(world, at_m + [0, 0, 0.03], 0.1)
    go(world, at_m, 0.1)
    turn_jaw(world, JAW_CLOSED_RAD)
    grasped = world.observe()
    twin = Twin(scene.for_bullet())
    twin.grasp(ARM, grasped.arms[ARM].setpoint_tissue_from_tip)
    go(world, at_m + [0, 0, 0.015], 0.02)
    arm = world.observe().arms[ARM]
    lag_m = np.linalg.norm(arm.tissue_from_tip.position_m - arm.setpoint_tissue_from_tip.position_m)
    for _ in range(10):
        world.step()
    lifted = world.observe()
    twin.track({ARM: lifted.arms[ARM].setpoint_tissue_from_tip}, lifted.time_s)
    yield Story(world, start, grasped, lifted, world.true_force_n(), float(lag_m), twin)
    world.close()


def test_it_starts_at_home_with_nothing_grasped(scene, story):
    for name, arm in scene.arms.items():
        seen = story.start.arms[name]
        np.testing.assert_allclose(seen.tissue_from_tip.position_m, arm.home_tip_m, atol=1e-6)
        assert seen.grasped is False


def test_pictures_show_tissue_and_hide_the_region(scene, story):
    sensed = sense(story.start, scene)
    assert sensed.faults == ()
    assert len(sensed.cloud.points_m) > 500
    assert abs(np.median(sensed.cloud.points_m[:, 2])) < 1e-3, "the upper face lies at z = 0"
    assert sensed.roi_visibility == 0.0


def test_the_world_hands_over_pictures_only(story):
    assert story.start.cloud is None
    assert story.start.roi_visibility is None
    assert story.start.depth_image.depth_m is not None
    assert story.start.endoscope_image.depth_m is None


def test_the_tip_follows_its_set_point(story):
    assert story.lag_m < 5e-4


def test_a_jaw_that_closes_on_tissue_stands_open(story):
    arm = story.grasped.arms[ARM]
    assert arm.grasped is True
    assert arm.jaw_rad > JAW_CLOSED_RAD + 0.1


def test_held_tissue_rises_and_pulls(story):
    highest_m = story.world.true_surface().vertices_m[:, 2].max()
    assert highest_m > 0.012
    assert story.force_n > 0.005


def test_the_twin_on_the_same_elements_agrees(story):
    gap_m = np.linalg.norm(
        story.world.true_surface().vertices_m - story.twin.state.surface.vertices_m, axis=1
    )
    assert np.median(gap_m) < 5e-4
    assert np.quantile(gap_m, 0.95) < 2e-3
    assert story.twin.force_n == pytest.approx(story.force_n, rel=0.15)


def test_release_lets_go(story):
    turn_jaw(story.world, JAW_OPEN_RAD)
    assert story.world.observe().arms[ARM].grasped is False
    assert story.world.true_force_n() == 0.0


def test_silence_is_a_hold_and_equal_commands_give_equal_worlds(scene):
    ends = []
    for _ in range(2):
        world = BulletWorld(scene, np.random.default_rng(5))
        world.command(Command({ARM: ArmCommand(linear_m_s=np.array([0.02, 0.0, 0.0]))}))
        world.step()
        moved = world.observe().arms[ARM].setpoint_tissue_from_tip.position_m
        world.step()
        held = world.observe()
        np.testing.assert_array_equal(held.arms[ARM].setpoint_tissue_from_tip.position_m, moved)
        ends.append((held.arms[ARM].joints, world.true_surface().vertices_m, held.depth_image))
        world.close()
    np.testing.assert_array_equal(ends[0][0], ends[1][0])
    np.testing.assert_array_equal(ends[0][1], ends[1][1])
    np.testing.assert_array_equal(ends[0][2].depth_m, ends[1][2].depth_m)


def test_heavy_tissue_has_come_to_lie_when_the_first_picture_is_taken(scene):
    heavy = scene.tissue.model_copy(update={"gravity_m_s2": 9.81})
    scene = scene.model_copy(update={"tissue": heavy})
    world = BulletWorld(scene, np.random.default_rng(0))
    lying = world.true_surface().vertices_m
    world.step()
    assert np.abs(world.true_surface().vertices_m - lying).max() < 1e-4
    expected = Twin(scene.for_bullet()).state.surface.vertices_m
    assert np.abs(lying[:, 2] - expected[:, 2]).max() < 3e-4
    assert lying[:, 2].min() < -heavy.thickness_m
    world.close()


def test_commands_that_make_no_sense_are_refused(story):
    with pytest.raises(ValueError, match="psm3"):
        story.world.command(Command({"psm3": ArmCommand()}))
    with pytest.raises(ValueError, match="not finite"):
        story.world.command(Command({ARM: ArmCommand(linear_m_s=np.array([np.nan, 0, 0]))}))


def test_an_arm_sent_out_of_reach_is_an_error_in_words(scene):
    world = BulletWorld(scene, np.random.default_rng(0))
    too_far = ArmCommand(linear_m_s=np.array([0.0, 0.0, 5.0]))
    world.command(Command({ARM: too_far}))
    with pytest.raises(WorldError, match="psm1"):
        world.step()
    world.close()
