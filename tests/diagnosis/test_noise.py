"""Noise and surrogates: what went in comes out, with gaps, outliers and few samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from defras_bt.diagnosis.layout import layout
from defras_bt.diagnosis.noise import estimate_noise, tolerances
from defras_bt.diagnosis.surrogates import surrogates
from tests.diagnosis.toy_problem import toy


@pytest.mark.parametrize(("ar", "gaps"), [((0.97,), 0.0), ((1.6, -0.64), 0.2), ((0.3,), 0.1)])
def test_an_autoregression_is_recovered(ar: tuple[float, ...], gaps: float) -> None:
    problem = toy(np.random.default_rng(2), {}, ar=ar, gaps=gaps, length=4000, channels=2)
    residual = problem.residual({})
    noise = estimate_noise(residual, problem.samples, layout(problem.samples))
    for channel in noise.channels:
        assert channel.ar[: len(ar)] == pytest.approx(ar, abs=0.08)
        assert np.abs(channel.ar[len(ar) :]).sum() < 0.1


def test_whitened_noise_is_white_and_of_variance_one() -> None:
    problem = toy(np.random.default_rng(3), {}, ar=(0.97,), gaps=0.1, length=4000, channels=2)
    residual = problem.residual({})
    noise = estimate_noise(residual, problem.samples, layout(problem.samples))
    new = noise.whiten(np.nan_to_num(residual)[:, None])[:, 0]
    assert new[noise.seen].std() == pytest.approx(1.0, abs=0.03)
    assert abs(np.mean(new[1:] * new[:-1])) < 0.03
    assert not new[~noise.seen].any()


def test_outliers_move_neither_scale_nor_autocorrelation_much() -> None:
    problem = toy(np.random.default_rng(4), {}, ar=(0.8,), length=3000, channels=1)
    residual = problem.residual({})
    clean = estimate_noise(residual, problem.samples, layout(problem.samples)).channels[0]
    residual[::100] = 50.0
    noise = estimate_noise(residual, problem.samples, layout(problem.samples))
    assert noise.channels[0].sd == pytest.approx(clean.sd, rel=0.15)
    assert noise.weight[::100].max() < 0.2


def test_surrogates_keep_spectrum_gaps_and_correlation_between_channels() -> None:
    rng = np.random.default_rng(5)
    problem = toy(rng, {}, ar=(0.9,), gaps=0.1, length=3000, channels=2, correlation=0.6)
    residual = problem.residual({})
    noise = estimate_noise(residual, problem.samples, layout(problem.samples))
    drawn = np.concatenate(list(surrogates(noise, residual, 60, rng)), axis=1)
    assert not drawn[~noise.seen].any()
    assert drawn[noise.seen].std() == pytest.approx(np.nanstd(residual), rel=0.1)
    first, second = drawn[:3000], drawn[3000:]
    both = noise.seen[:3000] & noise.seen[3000:]
    together = np.corrcoef(first[both].ravel(), second[both].ravel())[0, 1]
    measured = np.corrcoef(residual[:3000][both], residual[3000:][both])[0, 1]
    # A fifth of the rows lacks one of the two, and says nothing of both.
    assert 0.75 * measured < together < 1.05 * measured
    near = noise.seen[1:3000] & noise.seen[:2999]
    lagged = np.corrcoef(first[1:][near].ravel(), first[:-1][near].ravel())[0, 1]
    assert lagged == pytest.approx(0.9, abs=0.03)
    # Their phases are new: nothing of the residual itself is left in them.
    with_data = [np.corrcoef(d[noise.seen], residual[noise.seen])[0, 1] for d in drawn.T]
    assert abs(np.mean(with_data)) < 0.05


def test_a_channel_without_any_scale_is_refused() -> None:
    samples = toy(np.random.default_rng(0), {}, length=50).samples
    channels = tuple(replace(c, noise_sd=0.0, floor=0.0) for c in samples.channels)
    with pytest.raises(ValueError, match="channel q1: noise_sd or floor should be above zero"):
        tolerances(replace(samples, channels=channels))
