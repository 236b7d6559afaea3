"""Forces with which a jaw presses held tissue onto the bed are told from those that pull it."""

from __future__ import annotations

import numpy as np

from defras_bt.diagnosis.twins.tissue_pressed import LOW_M, PRESSED_N, pressed
from defras_sim.recorded_motion import ArmMotion

HEIGHT_M = np.array([0.0, 0.0, 0.01, 0.01, 0.001, 0.0, 0.0])
GRASPED = np.array([False, True, True, True, True, True, False])


def motion(start_m: float = 0.05) -> ArmMotion:
    """Over tissue, taken at the second instant, lifted, laid down, and let go."""
    position_m = np.zeros((len(HEIGHT_M), 3))
    position_m[:, 2] = start_m + HEIGHT_M
    return ArmMotion(position_m, np.tile(np.eye(3), (len(HEIGHT_M), 1, 1)), GRASPED)


def force_n(down_n: float) -> np.ndarray:
    return np.tile([0.01, 0.0, -down_n], (len(HEIGHT_M), 1))


def test_only_a_push_where_the_tissue_was_taken_is_one_onto_the_bed() -> None:
    frames = np.arange(len(HEIGHT_M))
    found = pressed(motion(), frames, force_n(2 * PRESSED_N))
    assert found.tolist() == [False, True, False, False, True, True, False]
    assert not pressed(motion(), frames, force_n(-2 * PRESSED_N)).any()
    assert not pressed(motion(), frames, force_n(0.5 * PRESSED_N)).any()


def test_noise_of_the_sensor_is_no_push() -> None:
    """Held over the bed for long: readings that point down by chance stay, a push does not."""
    rng = np.random.default_rng(2)
    count = 200
    still = ArmMotion(np.zeros((count, 3)), np.tile(np.eye(3), (count, 1, 1)), np.arange(count) > 5)
    for sd_n in (0.002, 0.02, 2.0):
        readings_n = sd_n * rng.standard_normal((count, 3))
        assert pressed(still, np.arange(count), readings_n).sum() <= 1
        readings_n[50:60, 2] -= 30.0 * sd_n
        found = pressed(still, np.arange(count), readings_n)
        assert found[50:60].all()


def test_height_counts_from_where_the_tissue_was_taken() -> None:
    frames = np.array([2, 4])
    for start_m in (-0.1, 0.0, 0.3):
        assert pressed(motion(start_m), frames, force_n(0.1)[frames]).tolist() == [False, True]
    assert HEIGHT_M[4] < LOW_M < HEIGHT_M[2]


def test_what_was_not_measured_or_never_held_is_no_push() -> None:
    frames = np.arange(len(HEIGHT_M))
    assert not pressed(motion(), frames, np.full((len(HEIGHT_M), 3), np.nan)).any()
    never = ArmMotion(motion().position_m, motion().rotation, np.zeros(len(HEIGHT_M), dtype=bool))
    assert not pressed(never, frames, force_n(0.1)).any()
