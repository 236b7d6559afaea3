"""The kinematic tool: exact motion, a jaw of finite speed, and what it takes to hold tissue."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from defras_sim.geometry import Pose
from defras_sim.worlds.kinematic_tool import JAW_ON_TISSUE_RAD, KinematicTool
from defras_sim.worlds.protocol import JAW_CLOSED_RAD, JAW_OPEN_RAD, ArmCommand

TICK_S = 0.05


def always(_: Pose) -> bool:
    return True


def never(_: Pose) -> bool:
    return False


def opened() -> KinematicTool:
    tool = KinematicTool.at(np.zeros(3))
    for _ in range(10):
        tool.step(ArmCommand(jaw_rad=JAW_OPEN_RAD), TICK_S, always)
    return tool


def close(tool: KinematicTool, on_tissue: Callable[[Pose], bool] = always) -> None:
    for _ in range(10):
        tool.step(ArmCommand(jaw_rad=JAW_CLOSED_RAD), TICK_S, on_tissue)


def test_it_integrates_the_commanded_velocity() -> None:
    tool = KinematicTool.at(np.array([0.0, 0.0, 0.02]))
    command = ArmCommand(np.array([0.01, 0.0, -0.02]), np.array([0.0, 0.0, np.pi]))
    for _ in range(20):
        assert tool.step(command, TICK_S, always)
    assert np.allclose(tool.tissue_from_tip.position_m, [0.01, 0.0, 0.0])
    assert np.allclose(tool.tissue_from_tip.rotation, np.diag([-1.0, 1.0, -1.0]), atol=1e-9)


def test_holding_still_changes_nothing() -> None:
    tool = KinematicTool.at(np.array([0.0, 0.0, 0.02]))
    pose = tool.tissue_from_tip
    assert not tool.step(ArmCommand(), TICK_S, always)
    assert tool.tissue_from_tip is pose


def test_the_jaw_moves_at_a_finite_rate() -> None:
    tool = KinematicTool.at(np.zeros(3))
    tool.step(ArmCommand(jaw_rad=JAW_OPEN_RAD), TICK_S, always)
    assert 0 < tool.jaw_rad < JAW_OPEN_RAD / 2
    # Without a new goal it goes on to the last one.
    for _ in range(10):
        tool.step(ArmCommand(), TICK_S, always)
    assert tool.jaw_rad == pytest.approx(JAW_OPEN_RAD)


def test_closing_on_tissue_stops_at_a_larger_angle_and_holds() -> None:
    tool = opened()
    assert not tool.grasped
    close(tool)
    assert tool.grasped
    assert tool.jaw_rad == JAW_ON_TISSUE_RAD


def test_closing_on_nothing_closes_fully() -> None:
    tool = opened()
    close(tool, never)
    assert not tool.grasped
    assert tool.jaw_rad == pytest.approx(JAW_CLOSED_RAD)


def test_a_jaw_that_was_not_wide_open_takes_nothing() -> None:
    tool = KinematicTool.at(np.zeros(3))
    tool.step(ArmCommand(jaw_rad=0.3), TICK_S, always)
    tool.step(ArmCommand(), TICK_S, always)
    close(tool)
    assert not tool.grasped


def test_opening_lets_go() -> None:
    tool = opened()
    close(tool)
    assert tool.step(ArmCommand(jaw_rad=JAW_OPEN_RAD), TICK_S, always)
    assert not tool.grasped
