"""Losses from inner products against fits made one by one."""

from __future__ import annotations

import numpy as np

from defras_bt.diagnosis.held_out import Bounded, losses, products

RNG = np.random.default_rng(3)
COLUMNS = RNG.standard_normal((120, 4))
RESIDUALS = RNG.standard_normal((120, 3)) + 2.0 * COLUMNS[:, :1]
FOLD = np.repeat(np.arange(6), 20)


def test_held_out_losses_are_those_of_fits_without_each_fold() -> None:
    chosen = np.array([0, 2])
    found = losses(products(COLUMNS, RESIDUALS, FOLD), chosen)
    for fold in range(6):
        train, test = fold != FOLD, fold == FOLD
        fitted = np.linalg.lstsq(COLUMNS[train][:, chosen], RESIDUALS[train], rcond=None)[0]
        left = RESIDUALS[test] - COLUMNS[test][:, chosen] @ fitted
        assert np.allclose(found.held_out[fold], (left**2).sum(axis=0), rtol=1e-3)
    fitted = np.linalg.lstsq(COLUMNS[:, chosen], RESIDUALS, rcond=None)[0]
    left = RESIDUALS - COLUMNS[:, chosen] @ fitted
    assert np.allclose(found.fitted, (left**2).sum(axis=0), rtol=1e-3)
    assert np.allclose(found.amplitudes, fitted, rtol=1e-3, atol=1e-4)


def test_a_bound_is_kept_and_the_others_make_the_best_of_it() -> None:
    chosen = np.array([0, 1])
    found = losses(products(COLUMNS, RESIDUALS, FOLD), chosen, (Bounded(0, 0.0, 1.0),))
    assert np.allclose(found.amplitudes[0], 1.0)
    rest = RESIDUALS - COLUMNS[:, :1]
    best = np.linalg.lstsq(COLUMNS[:, 1:2], rest, rcond=None)[0]
    assert np.allclose(found.amplitudes[1], best[0], rtol=1e-3, atol=1e-4)


def test_no_columns_leave_the_residual_as_it_is() -> None:
    found = losses(products(COLUMNS, RESIDUALS, FOLD), np.zeros(0, dtype=np.int64))
    assert np.allclose(found.total, (RESIDUALS**2).sum(axis=0))
