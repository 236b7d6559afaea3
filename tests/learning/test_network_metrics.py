"""Scores of probabilities against cases worked out by hand, and temperatures that are known."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.learning.training.calibration import fitted_temperature, mean_probability
from defras_bt.learning.training.metrics import calibration_error, overlap, prior, scores


def test_overlap_of_masks_worked_out_by_hand() -> None:
    found = np.array([True, True, True, False, False])
    wanted = np.array([True, False, True, True, False])
    precision, recall, f1 = overlap(found, wanted)
    assert (precision, recall) == (pytest.approx(2 / 3), pytest.approx(2 / 3))
    assert f1 == pytest.approx(2 / 3)
    nothing = np.zeros(5, bool)
    assert np.isnan(overlap(nothing, nothing)[2])
    assert overlap(found, nothing)[2] == 0.0


def test_calibration_is_perfect_where_what_is_said_comes_true() -> None:
    rng = np.random.default_rng(0)
    said = rng.uniform(size=200_000)
    truth = rng.uniform(size=len(said)) < said
    assert calibration_error(said, truth) < 0.01
    # Saying 0.9 of what is so in half of the cases is off by 0.4.
    coin = rng.uniform(size=10_000) < 0.5
    assert calibration_error(np.full(10_000, 0.9), coin) == pytest.approx(0.4, abs=0.02)


@pytest.mark.parametrize("temperature", [0.5, 1.0, 2.5])
def test_the_temperature_that_made_logits_too_sure_is_found(temperature: float) -> None:
    rng = np.random.default_rng(1)
    logits = rng.normal(0.0, 2.0, size=40_000)
    truth = rng.uniform(size=len(logits)) < 1 / (1 + np.exp(-logits))
    found = fitted_temperature(temperature * logits[None], truth)
    assert found == pytest.approx(temperature, rel=0.05)
    said = mean_probability(temperature * logits[None], found)
    assert calibration_error(said, truth) < 0.01


def test_the_prior_is_how_often_beliefs_come_true() -> None:
    believed = np.array([True, True, True, True, False, False])
    truth = np.array([True, True, True, False, False, True])
    said = prior(believed, truth, np.array([True, False]))
    np.testing.assert_allclose(said, [0.75, 0.5])


def test_scores_of_a_perfect_and_of_a_useless_network() -> None:
    rng = np.random.default_rng(2)
    truth = rng.uniform(size=5000) < 0.3
    believed = truth ^ (rng.uniform(size=5000) < 0.1)
    perfect = scores(np.where(truth, 0.999, 0.001), truth, believed)
    assert perfect.f1 == perfect.changes_f1 == 1.0
    assert perfect.cross_entropy < 0.002
    useless = scores(np.full(5000, 0.3), truth, believed)
    entropy = -0.3 * np.log(0.3) - 0.7 * np.log(0.7)
    assert useless.cross_entropy == pytest.approx(entropy, rel=0.03)
    assert useless.recall == 0.0
