"""Gains that chance would give are told from gains that it would not."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.learning.evidence import compare
from defras_sim.geometry import Floats


def places(rng: np.random.Generator, count: int = 1500) -> Floats:
    return rng.uniform(-0.06, 0.06, (count, 2))


def correlated(rng: np.random.Generator, at: Floats) -> Floats:
    """A smooth random field, correlated over 10 mm (half of a block)."""
    waves = rng.normal(size=(40, 2)) / 0.01
    phase = rng.uniform(0, 2 * np.pi, 40)
    return np.cos(at @ waves.T + phase).mean(axis=1) * np.sqrt(80)


def test_a_local_gain_is_evidence() -> None:
    rng = np.random.default_rng(0)
    at = places(rng)
    error = np.abs(rng.normal(0.0, 0.0005, len(at)))
    patch = np.linalg.norm(at - [0.02, 0.02], axis=1) < 0.03
    found = compare(error + 0.002 * patch, error, at, rng)
    assert found.chance < 0.01
    assert found.local_gain_m > 0.0008
    assert found.after_m == pytest.approx(error.mean())
    assert 0.2 < found.relative_gain < 0.8


def test_smooth_differences_that_help_no_more_than_they_harm_are_not_evidence() -> None:
    """A test over points would call 33 of these 100 proof at the same level."""
    rng = np.random.default_rng(1)
    false = 0
    for _ in range(100):
        at = places(rng)
        gain = 0.0005 * correlated(rng, at)
        false += compare(0.002 + gain, np.full(len(at), 0.002), at, rng).chance < 0.01
    assert false <= 10


def test_equal_predictions_are_no_evidence() -> None:
    rng = np.random.default_rng(2)
    at = places(rng)
    same = np.full(len(at), 0.001)
    found = compare(same, same, at, rng)
    assert found.touched_blocks == 0
    assert found.chance == 1.0
    assert found.relative_gain == 0.0


def test_a_gain_in_a_small_patch_is_evidence_too() -> None:
    """Four squares of 20 mm cannot gain by less chance than 1 in 16, however much they do."""
    rng = np.random.default_rng(3)
    at = places(rng)
    error = np.abs(rng.normal(0.0, 0.0005, len(at)))
    patch = np.linalg.norm(at - [0.02, 0.02], axis=1) < 0.015
    found = compare(error + 0.002 * patch, error, at, rng)
    assert found.chance < 0.01
    assert found.local_gain_m > 0.0005
    assert 1.0 < found.local_before_m / found.local_gain_m < 3.0


def test_a_gain_of_a_few_squares_among_many_is_evidence_too() -> None:
    """That four squares gain much is not for the signs of eight that lose a little to say."""
    rng = np.random.default_rng(6)
    at = places(rng)
    error = np.abs(rng.normal(0.0, 0.0005, len(at)))
    away_m = np.linalg.norm(at - [0.02, 0.02], axis=1)
    better, worse = away_m < 0.015, (away_m > 0.025) & (away_m < 0.035)
    found = compare(error + 0.002 * better, error + 0.0002 * worse, at, rng)
    assert found.chance < 0.01


def test_smooth_differences_in_a_small_patch_are_seldom_taken_for_evidence() -> None:
    rng = np.random.default_rng(4)
    false = 0
    for _ in range(100):
        at = places(rng)
        patch = np.linalg.norm(at - [0.02, 0.02], axis=1) < 0.015
        gain = 0.0005 * correlated(rng, at) * patch
        false += compare(0.002 + gain, np.full(len(at), 0.002), at, rng).chance < 0.01
    assert false <= 22
