"""A fitted model with every fold predicted from the others, near where the fit arrived."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defras_bt.diagnosis.held_out import Loss, losses, products
from defras_bt.diagnosis.noise import Noise
from defras_bt.diagnosis.problem import Integers
from defras_sim.geometry import Floats


@dataclass(frozen=True)
class HeldOut:
    """``loss`` in whitened squares; ``residual`` (n,) in the units of the data."""

    loss: Loss
    residual: Floats

    @property
    def total(self) -> float:
        return float(self.loss.total[0])


def hold_out(
    residual: Floats,
    columns: Floats,
    noise: Noise,
    fold: Integers,
    kept: int,
    fitted_with: Noise | None = None,
) -> HeldOut:
    """Fit ``columns`` (n, k) to ``residual`` (n,) without each fold and predict it.

    ``residual`` is of a fit; the last columns, from ``kept`` on, are of nuisances, which lower the
    loss but are not part of the model that is reported in ``HeldOut.residual``. That is fitted as
    if the noise were ``fitted_with`` where this is another than ``noise``.
    """
    filled = np.where(noise.seen, residual, 0.0)[:, None]
    found = products(noise.whiten(columns), noise.whiten(filled), fold)
    loss = losses(found, np.arange(columns.shape[1]))
    predicted = residual.copy()
    if kept:
        if fitted_with is not None:
            found = products(fitted_with.whiten(columns), fitted_with.whiten(filled), fold)
        plain = losses(found, np.arange(kept))
        for index, one in enumerate(np.unique(fold)):
            rows = fold == one
            predicted[rows] -= columns[rows, :kept] @ plain.fold_amplitudes[index, :, 0]
    return HeldOut(loss, predicted)
