"""What the metrics say while nothing is wrong, and the thresholds that follow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isnan, nan

import numpy as np
from scipy.stats import chi2

MIN_REST_FRAMES = 5


@dataclass(frozen=True)
class RestCalibration:
    """Rest value and warning thresholds of one metric, from frames before grasping.

    ``mean_m`` is subtracted from every later value (the paper's normalisation is a subtraction).
    ``noise_bound_m`` is exceeded above it by noise alone in ``false_alarm_rate`` of the frames.
    ``delta_m``: the scene's thresholds, all moved up together if the noise reaches the first.
    """

    mean_m: float
    spread_m: float
    noise_bound_m: float
    delta_m: tuple[float, float, float]
    false_alarm_rate: float
    frames: int

    def mu_m(self, value_m: float) -> float:
        """The monitored discrepancy of a metric's value: never below 0, NaN stays NaN."""
        return nan if isnan(value_m) else max(0.0, value_m - self.mean_m)

    def state(self, mu_m: float) -> int:
        """Warning state 0..3: how many thresholds ``mu_m`` exceeds."""
        return sum(mu_m > delta for delta in self.delta_m)

    def __str__(self) -> str:
        return (
            f"rest value {1e3 * self.mean_m:.2f} mm over {self.frames} frames; noise alone stays "
            f"below {1e3 * self.noise_bound_m:.2f} mm in all but {self.false_alarm_rate:g} of "
            f"frames; first warning at {1e3 * self.delta_m[0]:.2f} mm"
        )


def calibrate_rest(
    values_m: Sequence[float],
    delta_m: tuple[float, float, float],
    false_alarm_rate: float = 1e-5,
) -> RestCalibration:
    """Calibrate one metric on its rest values.

    The bound takes the noise as Gumbel distributed, the law of the largest of many; for a median,
    whose tail is lighter, that errs on the quiet side. Its spread is the upper 90 % confidence
    limit, since rest frames are few.

    Raises:
        ValueError: fewer than 5 finite values, or a rate outside (0, 1).
    """
    values = np.asarray(values_m, float)
    values = values[np.isfinite(values)]
    if len(values) < MIN_REST_FRAMES:
        raise ValueError(
            f"{len(values)} usable rest frames; calibration needs at least {MIN_REST_FRAMES}"
        )
    if not 0.0 < false_alarm_rate < 1.0:
        raise ValueError(f"false alarm rate {false_alarm_rate} should lie between 0 and 1")
    freedom = len(values) - 1
    spread = float(np.sqrt(np.var(values, ddof=1) * freedom / chi2.ppf(0.1, freedom)))
    scale = spread * np.sqrt(6.0) / np.pi
    bound = scale * (-np.log(-np.log1p(-false_alarm_rate)) - np.euler_gamma)
    raised = max(0.0, bound - delta_m[0])
    first, second, third = (delta + raised for delta in delta_m)
    return RestCalibration(
        float(values.mean()),
        spread,
        float(bound),
        (first, second, third),
        false_alarm_rate,
        len(values),
    )
