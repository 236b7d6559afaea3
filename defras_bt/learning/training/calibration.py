"""Temperature: one number by which logits are divided, so that probabilities come true.

Guo, Pleiss, Sun, Weinberger: On calibration of modern neural networks, ICML 2017.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from defras_sim.geometry import Floats


def fitted_temperature(logits: Floats, truth: NDArray[np.bool_]) -> float:
    """The temperature of least cross-entropy. ``logits`` (heads, n) of holes that are so (n,)."""

    def cross_entropy(log_temperature: float) -> float:
        probability = np.clip(mean_probability(logits, float(np.exp(log_temperature))), 1e-9, 1.0)
        wrong = np.clip(1.0 - probability, 1e-9, 1.0)
        return float(-np.where(truth, np.log(probability), np.log(wrong)).mean())

    found = minimize_scalar(cross_entropy, bounds=(np.log(0.2), np.log(8.0)), method="bounded")
    return float(np.exp(found.x))


def mean_probability(logits: Floats, temperature: float) -> Floats:
    """Mean over the heads (heads, ...) of what each says."""
    return np.asarray(each_probability(logits, temperature).mean(axis=0))


def each_probability(logits: Floats, temperature: float) -> Floats:
    """What each head says (heads, ...)."""
    return np.asarray(1.0 / (1.0 + np.exp(-np.clip(logits / temperature, -30.0, 30.0))))
