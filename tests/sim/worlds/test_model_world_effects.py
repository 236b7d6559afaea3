"""The model world is as wrong as its scene says, and a twin that adopts the same is right again."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from defras_bt.monitoring.warning import WarningMonitor
from defras_sim.effects.effect import Extension
from defras_sim.scene import Attachments, Roi, Scene
from defras_sim.twin import Twin
from defras_sim.worlds.model_world import ModelWorld
from defras_sim.worlds.protocol import (
    JAW_CLOSED_RAD,
    JAW_OPEN_RAD,
    ArmCommand,
    Command,
    Observation,
)

START_M = np.array([-0.05, 0.02, 0.0])
LIFTED_M = START_M + np.array([0.0, 0.0, 0.03])
MOVED_M = LIFTED_M + np.array([0.02, 0.0, 0.0])

NOTHING: Extension = {}


@cache
def scene() -> Scene:
    """Held along the largest x; a coarse mesh keeps the tests quick. PSM1 feels forces."""
    plain = Scene(
        name="right side",
        attachments=Attachments(map=("..........##",) * 12),
        roi=Roi(center_x_m=0.01, center_y_m=0.0),
    )
    psm1 = plain.arms["psm1"].model_copy(update={"force_noise_sd_n": 0.001})
    above = psm1.model_copy(update={"home_tip_m": (-0.05, 0.02, 0.005)})
    return plain.model_copy(
        update={
            "simulation": plain.simulation.model_copy(update={"elements_xyz": (5, 5, 1)}),
            "tissue": plain.tissue.model_copy(update={"elements_xyz": (5, 5, 1)}),
            "arms": {**plain.arms, "psm1": above},
        }
    )


def retract(world: ModelWorld, watch: Callable[[Observation], None]) -> None:
    """Grasp at the free edge, lift, move, hold."""

    def step(command: ArmCommand) -> None:
        world.command(Command({"psm1": command}))
        world.step()
        watch(world.observe())

    def drive(goal_m: np.ndarray, speed_m_s: float) -> None:
        while True:
            here = world.observe().arms["psm1"].setpoint_tissue_from_tip.position_m
            way = goal_m - here
            length = float(np.linalg.norm(way))
            if length < 1e-9:
                return
            velocity = way / length * min(speed_m_s, length / world.tick_s)
            step(ArmCommand(linear_m_s=velocity))

    watch(world.observe())
    for _ in range(12):
        step(ArmCommand())
    drive(START_M, 0.05)
    for jaw_rad in (JAW_OPEN_RAD, JAW_CLOSED_RAD):
        for _ in range(6):
            step(ArmCommand(jaw_rad=jaw_rad))
    drive(LIFTED_M, 0.03)
    drive(MOVED_M, 0.03)
    for _ in range(10):
        step(ArmCommand())


def observed(actual: Extension) -> list[Observation]:
    seen: list[Observation] = []
    retract(ModelWorld(scene().extended(actual), np.random.default_rng(1)), seen.append)
    return seen


def worst_mu_m(actual: Extension, adopted: Extension) -> float:
    """Largest discrepancy over a retraction in a world with some effects, for a twin with some."""
    believed = scene().extended(adopted)
    twin, monitor, mu_m = Twin(believed), WarningMonitor(believed), [0.0]

    def watch(seen: Observation) -> None:
        arm = seen.arms["psm1"]
        if arm.grasped and not twin.holding:
            twin.grasp("psm1", arm.setpoint_tissue_from_tip, seen.time_s)
        setpoints = {name: each.setpoint_tissue_from_tip for name, each in seen.arms.items()}
        surface = twin.track(setpoints, seen.time_s).surface
        cloud = None if seen.cloud is None else twin.corrected(seen.cloud)
        if not twin.holding:
            monitor.observe_rest(cloud, surface)
        if monitor.calibration:
            mu_m.append(monitor.reading(cloud, surface, seen.time_s).mu_m["local"])

    retract(ModelWorld(scene().extended(actual), np.random.default_rng(1)), watch)
    assert twin.holding == ("psm1",)
    return float(np.nanmax(mu_m))


@pytest.mark.parametrize(
    "hidden",
    [
        {"camera_latency": {"delay_s": 0.3}},
        {"camera_registration": {"turn_z_rad": 0.05}, "depth_bias": {"scale": 0.9}},
        {"grasp_slip": {"distance_m": 0.01, "time_s": 2.5}, "tool_offset": {"turn_z_rad": 0.2}},
        {"extra_attachment": {"x_m": -0.02, "y_m": 0.02, "share": 1.0}},
    ],
    ids=" and ".join,
)
def test_what_is_adopted_no_longer_disagrees(hidden: Extension) -> None:
    wrong_m, right_m = worst_mu_m(hidden, NOTHING), worst_mu_m(hidden, hidden)
    assert wrong_m > 0.002
    assert right_m < 0.0005


def test_without_effects_nothing_disagrees_and_the_sensors_are_those_of_a_plain_world() -> None:
    assert worst_mu_m(NOTHING, NOTHING) < 0.0005
    absent = {"tool_offset": {}, "grasp_slip": {"time_s": 1.0}, "depth_bias": {"scale": 1.0}}
    for plain, null in zip(observed(NOTHING), observed(absent), strict=True):
        assert plain.time_s == null.time_s
        assert plain.cloud is not None
        assert null.cloud is not None
        assert np.array_equal(plain.cloud.points_m, null.cloud.points_m)
        tips = [seen.arms["psm1"].tissue_from_tip.position_m for seen in (plain, null)]
        assert np.array_equal(*tips)


def test_encoders_tell_of_a_lag_and_of_nothing_behind_them() -> None:
    def off_m(actual: Extension) -> float:
        return max(
            float(
                np.linalg.norm(
                    arm.tissue_from_tip.position_m - arm.setpoint_tissue_from_tip.position_m
                )
            )
            for arm in (seen.arms["psm1"] for seen in observed(actual))
        )

    assert off_m({"tool_offset": {"x_m": 0.003}}) < 2e-4, "encoder noise alone"
    lag = {f"q{n}_s": 0.1 for n in range(1, 7)}
    assert off_m({"servo_lag": lag}) == pytest.approx(0.1 * 0.03, rel=0.1)


def test_a_force_sensor_says_what_the_jaw_exerts() -> None:
    world = ModelWorld(scene(), np.random.default_rng(1))
    felt_n: list[np.ndarray] = []
    true_n: list[float] = []

    def watch(seen: Observation) -> None:
        assert seen.arms["psm2"].force_n is None
        felt = seen.arms["psm1"].force_n
        assert felt is not None
        felt_n.append(felt)
        true_n.append(world.true_force_n())

    retract(world, watch)
    lengths = np.linalg.norm(felt_n, axis=1)
    assert np.max(felt_n, axis=0)[2] > 0.005, "the jaw pulls the tissue up"
    assert np.abs(lengths - true_n).max() < 0.006
    at_rest = np.array(felt_n)[np.array(true_n) == 0.0]
    assert at_rest.std() == pytest.approx(0.001, rel=0.3)


def test_tissue_that_fades_needs_no_motion_to_change() -> None:
    world = ModelWorld(
        scene().extended({"stress_relaxation": {"fraction": 0.6, "time_s": 0.3}}),
        np.random.default_rng(1),
    )
    force_n: list[float] = []
    retract(world, lambda seen: force_n.append(world.true_force_n()))
    held = force_n[-10:]
    assert np.all(np.diff(held) < 0.0)
    assert held[-1] < 0.9 * held[0]
