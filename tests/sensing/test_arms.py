"""Arms that do not follow, and arms that are where they cannot be."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.sensing.arms import FOLLOWING_M, JUMP_M, ArmPlausibility
from defras_bt.sensing.dead_reckoning import STRAYED_M
from defras_sim.geometry import Pose
from defras_sim.scene import Attachments, Roi, Scene
from defras_sim.worlds.protocol import ArmCommand, ArmObservation, Command, Observation

SCENE = Scene(
    name="s", attachments=Attachments(map=("#" * 12,) * 12), roi=Roi(center_x_m=0, center_y_m=0)
)
SPEED_M_S = SCENE.motion.reach_speed_m_s


def faults(
    check: ArmPlausibility,
    time_s: float,
    x_m: float,
    setpoint_x_m: float | None = None,
    *,
    goal_x_m: float | None = None,
    by_hand: bool = False,
) -> str:
    """What is said of an arm at ``x_m``; "" if nothing. ``goal_x_m``: where its stream leads."""
    at = Pose(np.array([x_m, 0.0, 0.0]))
    told = at if setpoint_x_m is None else Pose(np.array([setpoint_x_m, 0.0, 0.0]))
    goal = None if goal_x_m is None else Pose(np.array([goal_x_m, 0.0, 0.0]))
    arm = ArmObservation(time_s, at, told, 0.0, goal_tissue_from_tip=goal)
    return check.faults(Observation(time_s, {"psm1": arm}), driven_by_hand=by_hand).get("psm1", "")


def go(check: ArmPlausibility, time_s: float, speed_m_s: float = SPEED_M_S) -> None:
    """The arm is told to go along x for a tick."""
    check.sent(time_s, Command({"psm1": ArmCommand(np.array([speed_m_s, 0.0, 0.0]))}))


@pytest.fixture
def check() -> ArmPlausibility:
    return ArmPlausibility(SCENE)


def test_an_arm_that_its_world_stopped_is_believed_where_it_stands(check) -> None:
    stopped_m = 0.0
    assert faults(check, 0.0, stopped_m) == ""
    for tick in range(6):
        go(check, 0.05 * tick)
    at = Pose(np.array([stopped_m, 0.0, 0.0]))
    arm = ArmObservation(0.3, at, at, 0.0)
    unsaid = check.faults(Observation(0.3, {"psm1": arm}), driven_by_hand=False)
    assert "does not follow" in unsaid["psm1"]
    said = Observation(0.35, {"psm1": arm}, stopped={"psm1": "it is PAUSED"})
    check.faults(said, driven_by_hand=False)
    assert faults(check, 0.4, stopped_m) == ""


def test_full_speed_is_believed_also_over_a_gap_in_the_messages(check) -> None:
    for tick in range(12):
        go(check, 0.05 * tick)
    for time_s in (0.0, 0.05, 0.1, 0.5, 0.55):
        assert faults(check, time_s, SPEED_M_S * time_s) == ""


def test_a_tip_away_from_its_set_point_does_not_follow(check) -> None:
    assert faults(check, 0.0, 0.0, 0.9 * FOLLOWING_M) == ""
    assert "psm1 does not follow: its tip is 3.3 mm away" in faults(check, 0.05, 0.0, 0.0033)
    assert faults(check, 0.1, 0.0, 0.9 * FOLLOWING_M) == "", "it has caught up"


def test_a_jump_is_not_believed_however_long_it_lasts(check) -> None:
    faults(check, 0.0, 0.0)
    for time_s in (0.05, 1.0, 10.0):
        assert "20.0 mm away from where it can be" in faults(check, time_s, 0.02)
    assert faults(check, 10.05, JUMP_M / 2) == "", "it is back"
    assert faults(check, 10.1, JUMP_M / 2) == ""


def test_what_was_driven_by_hand_is_believed_where_it_stands(check) -> None:
    faults(check, 0.0, 0.0)
    assert faults(check, 0.05, 0.05)
    assert faults(check, 0.1, 0.08, by_hand=True) == ""
    assert faults(check, 0.15, 0.08) == ""


def test_what_is_no_number_is_left_to_freshness_and_is_no_place_to_jump_from(check) -> None:
    faults(check, 0.0, 0.0)
    assert faults(check, 0.05, float("nan")) == ""
    assert faults(check, 0.1, 0.0) == ""


@pytest.mark.parametrize("speed_m_s", [SPEED_M_S, 0.015, 0.001])
def test_an_arm_that_stays_does_not_follow_however_slowly_it_was_told_to_go(
    check, speed_m_s
) -> None:
    told_m, time_s = 0.0, 0.0
    while not faults(check, time_s, 0.0):
        go(check, time_s, speed_m_s)
        told_m, time_s = told_m + 0.05 * speed_m_s, time_s + 0.05
        assert told_m < 2 * STRAYED_M
    assert told_m > STRAYED_M
    assert "psm1 does not follow: its set-point is" in faults(check, time_s + 5.0, 0.0)


@pytest.mark.parametrize(("gives_up", "told"), [(0.5, False), (0.0, True)])
def test_what_a_stream_gave_up_between_late_ticks_is_not_missed(check, gives_up, told) -> None:
    """Each tick came so late that motion had ended, with half a tick's way left; an arm that only
    stays behind its stream is still found out."""
    step_m = 0.05 * SPEED_M_S
    gone_m, goal_m, said = 0.0, 0.0, []
    for tick in range(20):
        said.append(faults(check, 0.5 * tick, gone_m, goal_x_m=goal_m))
        go(check, 0.5 * tick)
        gone_m, goal_m = gone_m + 0.5 * step_m, goal_m + (1.0 - gives_up) * step_m
    assert any(said) is told


@pytest.mark.parametrize("goal_m", [float("nan"), float("inf")])
def test_a_goal_that_is_no_number_excuses_nothing(check, goal_m) -> None:
    for tick in range(10):
        said = faults(check, 0.05 * tick, 0.0, goal_x_m=goal_m)
        go(check, 0.05 * tick)
    assert "does not follow" in said


def test_it_is_believed_again_where_the_commands_led(check) -> None:
    """The driver that repeated itself delivers again: the arm has moved all along."""
    for tick in range(4):
        faults(check, 0.05 * tick, 0.0)
        go(check, 0.05 * tick)
    assert faults(check, 0.2, 0.0)
    assert faults(check, 0.25, 0.2 * SPEED_M_S) != "", "the way there looks like a jump"
    assert faults(check, 0.3, 0.0)


def test_what_did_not_hear_is_believed_after_it_was_driven_by_hand(check) -> None:
    for tick in range(4):
        faults(check, 0.05 * tick, 0.0)
        go(check, 0.05 * tick)
    assert faults(check, 0.2, 0.0)
    assert faults(check, 0.25, 0.0, by_hand=True) == ""
    assert faults(check, 0.3, 0.0) == ""
