"""What effects do to an arm, against what their laws say of simple motions."""

import numpy as np
import pytest

from defras_sim.arm.true_joints import true_joints
from defras_sim.effects.arm_compliance import EFFECT as ARM_COMPLIANCE
from defras_sim.effects.arm_compliance import USUAL_REACH_M
from defras_sim.effects.joint_coupling import EFFECT as JOINT_COUPLING
from defras_sim.effects.joint_offset import EFFECT as JOINT_OFFSET
from defras_sim.effects.joint_play import EFFECT as JOINT_PLAY
from defras_sim.effects.joint_play import lost_motion
from defras_sim.effects.servo_lag import EFFECT as SERVO_LAG
from defras_sim.effects.servo_lag import lagging

ON_JOINTS = (JOINT_OFFSET, JOINT_COUPLING, JOINT_PLAY, SERVO_LAG)
STRENGTHS = [
    (JOINT_OFFSET, {"q3_m": 0.002}),
    (JOINT_COUPLING, {"q6_from_q5": 0.2}),
    (JOINT_PLAY, {"q5_rad": 0.1, "q6_dragged_by_q5": 0.5}),
    (SERVO_LAG, {"q1_s": 0.05}),
]


@pytest.fixture
def motion() -> tuple[np.ndarray, np.ndarray]:
    """Smooth random joints (300, 6) over uneven times."""
    rng = np.random.default_rng(5)
    time_s = np.cumsum(rng.uniform(0.005, 0.05, 300))
    phase = rng.uniform(0, 6, 6)
    scale = np.array([0.5, 0.4, 0.05, 1.0, 0.8, 0.8])
    return time_s, scale * np.sin(time_s[:, None] * rng.uniform(1, 4, 6) + phase)


@pytest.mark.parametrize("effect", ON_JOINTS, ids=lambda effect: effect.name)
def test_nothing_changes_at_the_null_values(effect, motion):
    time_s, joints = motion
    assert np.array_equal(effect.joints({}, time_s, joints), joints)


@pytest.mark.parametrize(("effect", "values"), STRENGTHS, ids=lambda each: str(each))
def test_what_comes_later_changes_nothing_before(effect, values, motion):
    time_s, joints = motion
    whole = effect.joints(values, time_s, joints)
    assert not np.array_equal(whole, joints)
    assert np.array_equal(effect.joints(values, time_s[:200], joints[:200]), whole[:200])


def test_effects_act_in_the_order_of_the_drive_however_they_are_listed(motion):
    time_s, joints = motion
    model = {effect.name: values for effect, values in STRENGTHS}
    turned = dict(reversed(model.items()))
    assert np.array_equal(true_joints(model, time_s, joints), true_joints(turned, time_s, joints))
    by_hand = SERVO_LAG.joints(model["servo_lag"], time_s, joints)
    by_hand = JOINT_PLAY.joints(model["joint_play"], time_s, by_hand)
    by_hand = JOINT_COUPLING.joints(model["joint_coupling"], time_s, by_hand)
    assert np.array_equal(true_joints(model, time_s, joints), by_hand + [0, 0, 0.002, 0, 0, 0])


def test_an_effect_of_something_else_is_refused(motion):
    with pytest.raises(ValueError, match="stiffness does not act on an arm"):
        true_joints({"stiffness": {"scale": 2.0}}, *motion)


def test_play_is_a_gap_that_the_drive_has_to_cross():
    drive = np.array([0.0, 1.0, 2.0, 1.9, 1.1, 1.0, 0.0, 0.9, 1.5])
    # Width 1: the output is half a unit behind, waits while the drive turns back by one.
    output = np.array([0.0, 0.5, 1.5, 1.5, 1.5, 1.5, 0.5, 0.5, 1.0])
    assert lost_motion(drive, 1.0) == pytest.approx(drive - output)


def test_play_knows_no_speed_and_no_rows_between():
    drive = np.sin(np.linspace(0, 20, 400)) * np.linspace(1, 0.2, 400)
    finer = np.interp(np.arange(0, 399.01, 0.25), np.arange(400), drive)
    assert lost_motion(finer, 0.3)[::4] == pytest.approx(lost_motion(drive, 0.3))


def test_play_smaller_than_its_gap_moves_nothing():
    drive = 0.1 * np.sin(np.linspace(0, 20, 100))
    assert drive - lost_motion(drive, 0.4) == pytest.approx(np.full(100, drive[0]))


def test_lost_motion_drags_joints_on_the_same_cables(motion):
    time_s, joints = motion
    values = {"q5_rad": 0.2, "q5_share": 0.6, "q6_dragged_by_q5": 0.5, "q4_dragged_by_q5": -0.1}
    lost = joints[:, 4] - JOINT_PLAY.joints({"q5_rad": 0.2}, time_s, joints)[:, 4]
    moved = JOINT_PLAY.joints(values, time_s, joints) - joints
    assert np.ptp(lost) > 0.1
    assert moved == pytest.approx(np.outer(lost, [0, 0, 0, -0.1, -0.6, 0.5]))


def test_a_steady_motion_is_late_by_the_lag():
    time_s = np.arange(0, 1, 0.01)
    late = lagging(time_s, 0.3 * time_s, 0.05)
    assert late[-1] == pytest.approx(0.3 * (time_s[-1] - 0.05), rel=1e-6)


def test_a_step_is_followed_exponentially_whatever_the_rows():
    time_s = np.concatenate([[0.0, 1e-9], np.cumsum(np.random.default_rng(1).uniform(0, 0.03, 50))])
    step = np.concatenate([[0.0], np.ones(len(time_s) - 1)])
    assert lagging(time_s, step, 0.05) == pytest.approx(1 - np.exp(-time_s / 0.05), abs=1e-6)


def test_coupling_is_linear_in_all_joints(motion):
    time_s, joints = motion
    values = {"q6_from_q5": 0.2, "q4_from_q4": -0.1}
    moved = JOINT_COUPLING.joints(values, time_s, joints) - joints
    assert moved[:, 5] == pytest.approx(0.2 * joints[:, 4])
    assert moved[:, 3] == pytest.approx(-0.1 * joints[:, 3])
    assert not moved[:, [0, 1, 2, 4]].any()


def test_a_longer_reach_gives_way_more_along_the_force():
    values = {"x_m_per_n": 1e-3, "x_growth_per_n": 5e-3}
    reach_m = np.array([USUAL_REACH_M, USUAL_REACH_M + 0.05])
    tip_m = np.stack([0 * reach_m, 0 * reach_m, 0.2 - reach_m], axis=1)
    force_n = np.tile([2.0, 1.0, 0.0], (2, 1))
    shift_m, turn = ARM_COMPLIANCE.tip_error(values, tip_m, force_n, np.array([0.0, 0.0, 0.2]))
    assert shift_m == pytest.approx(np.array([[2e-3, 0, 0], [2.5e-3, 0, 0]]))
    assert not turn.any()


def test_an_arm_never_moves_against_the_force():
    values = {"x_m_per_n": 1e-4, "x_growth_per_n": 5e-3}
    shift_m = ARM_COMPLIANCE.deflection_m(values, np.array([0.05]), np.array([[1.0, 0.0, 0.0]]))
    assert shift_m[0, 0] == 0.0
