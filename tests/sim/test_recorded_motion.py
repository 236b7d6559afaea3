"""A recorded motion is whole, or refused."""

from __future__ import annotations

import numpy as np
import pytest

from defras_sim.recorded_motion import ArmMotion, RecordedMotion


def arm(count: int) -> ArmMotion:
    return ArmMotion(
        np.arange(3.0 * count).reshape(count, 3),
        np.tile(np.eye(3), (count, 1, 1)),
        np.zeros(count, bool),
    )


def test_some_of_its_instants_are_a_motion_too() -> None:
    motion = RecordedMotion(np.array([0.0, 0.1, 0.3]), {"psm1": arm(3)})
    some = motion.taken(np.array([0, 2]))
    assert len(some) == 2
    assert some.time_s.tolist() == [0.0, 0.3]
    assert np.array_equal(some.tips(1)["psm1"].position_m, motion.arms["psm1"].position_m[2])


@pytest.mark.parametrize(
    ("time_s", "count", "words"),
    [
        ([], 0, "one instant or more"),
        ([0.0, 0.0], 2, "increasing"),
        ([0.0, np.nan], 2, "finite"),
        ([0.0, 0.1, 0.2], 2, "the motion of psm1 should have positions"),
    ],
)
def test_what_is_not_whole_is_refused(time_s: list[float], count: int, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        RecordedMotion(np.array(time_s), {"psm1": arm(count)})


def test_a_place_that_is_no_number_is_refused() -> None:
    lost = arm(2)
    lost.position_m[1, 0] = np.nan
    with pytest.raises(ValueError, match="not finite"):
        RecordedMotion(np.array([0.0, 0.1]), {"psm1": lost})
