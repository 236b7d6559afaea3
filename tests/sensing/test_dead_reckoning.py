"""The reckoning follows arms that obey, late or inexactly, and leaves those that do not."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.sensing.dead_reckoning import STRAYED_M, DeadReckoning
from defras_sim.geometry import Pose

TICK_S = 0.05


def strays_m(
    velocities_m_s: np.ndarray, *, share: float = 1.0, late_s: float = 0.0, age_s: float = 0.0
) -> np.ndarray:
    """What is found of an arm that does ``share`` of what it is told, ``late_s`` later.

    Each reading is ``age_s`` old. The way is integrated finely, apart from the reckoning.
    """
    fine = 50
    steps_m = np.repeat(velocities_m_s, fine, axis=0) * TICK_S / fine * share
    path_m = np.vstack([np.zeros(3), np.cumsum(steps_m, axis=0)])
    times_s = np.arange(len(path_m)) * TICK_S / fine
    reckoning, found = DeadReckoning(), []
    for tick, velocity_m_s in enumerate(velocities_m_s):
        read_s = tick * TICK_S - age_s
        at_m = [np.interp(read_s - late_s, times_s, axis) for axis in path_m.T]
        found.append(reckoning.strayed_m(read_s, Pose(np.array(at_m))))
        reckoning.sent(tick * TICK_S, velocity_m_s, TICK_S)
    return np.array(found)


@pytest.fixture
def wandering_m_s() -> np.ndarray:
    """Velocities (400, 3): every second another direction, at up to full speed."""
    rng = np.random.default_rng(0)
    directions = rng.standard_normal((20, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return np.repeat(directions * rng.uniform(0.0, 0.05, (20, 1)), 20, axis=0)


def test_an_arm_that_obeys_never_strays(wandering_m_s) -> None:
    assert strays_m(wandering_m_s).max() < 1e-12


def test_old_readings_are_compared_with_where_the_arm_was_then(wandering_m_s) -> None:
    assert strays_m(wandering_m_s, age_s=0.32).max() < 1e-12


@pytest.mark.parametrize("share", [0.92, 1.08])
def test_an_inexact_arm_never_strays_far(wandering_m_s, share) -> None:
    assert strays_m(wandering_m_s, share=share).max() < STRAYED_M


def test_a_command_that_takes_effect_a_tick_late_is_allowed() -> None:
    ahead = np.tile([0.05, 0.0, 0.0], (60, 1))
    assert strays_m(ahead, late_s=TICK_S).max() < STRAYED_M


@pytest.mark.parametrize("share", [0.0, 0.5, -1.0, 2.0])
def test_an_arm_that_does_something_else_strays(share) -> None:
    ahead = np.tile([0.0, 0.0, 0.01], (60, 1))
    assert strays_m(ahead, share=share).max() > STRAYED_M
