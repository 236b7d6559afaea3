"""What a jaw holds, and where the held patch goes, with grasps that are not as firm as meant."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from defras_sim.effects.grasp_effect import GraspEffect
from defras_sim.effects.grasp_layer import GraspLayer
from defras_sim.effects.grasp_offset import EFFECT as OFFSET
from defras_sim.effects.grasp_slip import EFFECT as SLIP
from defras_sim.effects.grasp_slip import SLIDING_S
from defras_sim.geometry import Pose

START = Pose(np.array([0.01, 0.02, 0.0]))
FIRST_S = 3.0


def lifted(height_m: float) -> Pose:
    return START.moved(np.array([0.0, 0.0, height_m]))


def slipping(distance_m: float, time_s: float) -> GraspLayer:
    values = {"distance_m": distance_m, "time_s": time_s}
    return GraspLayer([(SLIP, values)], FIRST_S, START)


def pull(layer: GraspLayer, until_s: float = 5.0, step_s: float = 0.05) -> list[np.ndarray]:
    """Held positions while the tip rises at 20 mm/s from the grasp on."""
    times = np.arange(FIRST_S, until_s + 1e-9, step_s)
    return [layer.held(t, lifted(0.02 * (t - FIRST_S))).position_m for t in times]


@pytest.mark.parametrize("effect", [OFFSET, SLIP])
def test_at_null_values_the_patch_goes_with_the_tip(effect: GraspEffect) -> None:
    layer = GraspLayer([(effect, effect.complete({}))], FIRST_S, START)
    assert np.array_equal(layer.taken.position_m, START.position_m)
    assert np.allclose(pull(layer)[-1], lifted(0.04).position_m, atol=1e-15)


def test_the_patch_slides_back_along_the_way_and_then_follows_again() -> None:
    held = pull(slipping(0.006, 4.0))
    height_m = np.array([position[2] for position in held])
    tip_m = 0.02 * (np.arange(len(held)) * 0.05)
    behind_m = tip_m - height_m
    slipped = np.arange(len(held)) * 0.05 + FIRST_S
    assert np.allclose(behind_m[slipped <= 4.0], 0.0, atol=1e-12)
    assert np.allclose(behind_m[slipped >= 4.0 + SLIDING_S], 0.006, atol=1e-12)
    assert np.all(np.diff(behind_m) > -1e-12)


def test_no_patch_slides_farther_than_it_was_carried() -> None:
    held = pull(slipping(0.05, 4.0))
    assert held[-1][2] == pytest.approx(0.04 - 0.02)


def test_before_the_grasp_there_is_nothing_to_slip() -> None:
    assert np.allclose(pull(slipping(0.006, 1.0))[-1], lifted(0.04).position_m, atol=1e-15)


def test_the_slip_is_where_it_was_whatever_the_steps_are() -> None:
    fine, coarse = pull(slipping(0.006, 4.03), step_s=0.01), pull(slipping(0.006, 4.03))
    assert np.allclose(fine[-1], coarse[-1], atol=1e-9)


def test_a_patch_taken_beside_the_tip_turns_with_it() -> None:
    layer = GraspLayer([(OFFSET, {"x_m": 0.004, "y_m": 0.0})], FIRST_S, START)
    assert np.allclose(layer.taken.position_m - START.position_m, [0.004, 0.0, 0.0])
    quarter = Rotation.from_euler("z", np.pi / 2).as_matrix()
    held = layer.held(4.0, Pose(START.position_m, quarter))
    assert np.allclose(held.position_m - START.position_m, [0.0, 0.004, 0.0])
    assert np.allclose(held.rotation, quarter)


def test_times_that_come_again_replace_what_was_told_before() -> None:
    layer, told_twice = slipping(0.006, 4.0), slipping(0.006, 4.0)
    told_twice.held(3.9, lifted(0.5))
    assert np.allclose(pull(layer)[-1], pull(told_twice)[-1], atol=1e-15)
