"""A drive that keeps a state goes where the effects on whole histories say."""

import numpy as np
import pytest

from defras_bt.dvrk.stand_in.drive import Drive, joints_near
from defras_sim.arm.kinematics import tip_pose
from defras_sim.effects import library
from defras_sim.effects.effect import ArmEffect
from defras_sim.geometry import Pose
from defras_sim.worlds.error import CannotImitate

RCM_M = np.array([0.0, 0.09, 0.2])
START = np.array([0.1, -0.2, 0.12, 0.3, 0.2, -0.1])
PULL_N = np.array([0.5, -1.0, 0.2])


def wandering(rows: int, rng: np.random.Generator) -> np.ndarray:
    """Joints (rows, 6) that turn round often."""
    phase = rng.uniform(0, 2 * np.pi, 6)
    speed = rng.uniform(1, 4, 6)
    time_s = 0.01 * np.arange(rows)[:, None]
    reach = np.array([0.2, 0.2, 0.02, 0.5, 0.4, 0.4])
    return START + reach * (np.sin(speed * time_s + phase) - np.sin(phase))


def adopted(**effects: dict[str, float]) -> list[tuple[ArmEffect, dict[str, float]]]:
    found = []
    for name, values in effects.items():
        effect = library.effect(name)
        assert isinstance(effect, ArmEffect)
        found.append((effect, values))
    return found


@pytest.mark.parametrize(
    "effects",
    [
        {"servo_lag": {"q1_s": 0.05, "q3_s": 0.04}},
        {"joint_play": {"q5_rad": 0.3, "q5_share": 0.6, "q6_dragged_by_q5": 0.3, "q3_m": 0.002}},
        {"joint_coupling": {"q6_from_q5": 0.2}, "joint_offset": {"q4_rad": 0.1}},
        {
            "servo_lag": {"q5_s": 0.03},
            "joint_play": {"q5_rad": 0.2, "q6_rad": 0.3, "q5_dragged_by_q6": 0.5},
            "joint_coupling": {"q5_from_q6": -0.1, "q6_from_q6": 0.05},
        },
    ],
)
def test_it_agrees_with_the_effects_on_the_whole_history(effects):
    told = wandering(300, np.random.default_rng(3))
    time_s = 0.01 * np.arange(len(told))
    chain = sorted(adopted(**effects), key=lambda each: each[0].place)
    drive = Drive(RCM_M, chain, told[0])
    tips, encoders = [], []
    for joints in told[1:]:
        drive.follow(joints, 0.01)
        tips.append(drive.tip(np.zeros(3)).position_m)
        encoders.append(drive.encoded)
    true, seen = told, told
    for effect, values in chain:
        true = effect.joints(values, time_s, true)
        seen = effect.joints(values, time_s, seen) if effect.encoders_see else seen
    expected = [tip_pose(row).position_m + RCM_M for row in true[1:]]
    assert np.allclose(tips, expected, atol=1e-9)
    assert np.allclose(encoders, seen[1:], atol=1e-9)


def test_effects_on_the_tip_see_its_place_and_its_pull():
    values = {"x_m_per_n": 1e-3}
    drive = Drive(RCM_M, adopted(arm_compliance=values), START)
    moved = drive.tip(PULL_N).position_m - drive.tip(np.zeros(3)).position_m
    assert moved == pytest.approx([5e-4, 0.0, 0.0], abs=1e-9)


def test_an_effect_that_remembers_in_a_way_of_its_own_is_not_imitated():
    class Sulking(ArmEffect):
        name = "sulking"
        parameters = ()

        def joints(self, values, time_s, joints):
            return joints - joints.mean(axis=0)

    with pytest.raises(CannotImitate, match="sulking"):
        Drive(RCM_M, [(Sulking(), {})], START)


def test_joints_near_keep_the_roll_from_jumping():
    joints = np.array([0.2, 0.1, 0.14, 4.0, 0.2, -0.2])
    assert joints_near(tip_pose(joints), joints) == pytest.approx(joints, abs=1e-9)
    assert joints_near(tip_pose(joints), np.zeros(6))[3] == pytest.approx(4.0 - 2 * np.pi)
    assert isinstance(tip_pose(joints), Pose)
