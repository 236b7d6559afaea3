"""What one metric said over time: its rest values, and the state it is believed to be in."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from math import inf, isfinite, isnan

from defras_bt.monitoring.rest import MIN_REST_FRAMES, RestCalibration, calibrate_rest

CONFIRMING_FRAMES = 2
"""A state is believed when this many camera frames in a row reach it: noise of one frame neither
stops a motion nor teaches the twin. Costs one camera period, 1.5 mm at the speed with tissue."""
_MAX_REST_FRAMES = 100


class MetricTrack:
    """Takes one value of a metric per camera frame.

    Attributes:
        calibration: from the rest values; None until :meth:`calibrate`.
        mu_m: the monitored discrepancy in the latest frame; NaN where it cannot be said.
        state: the confirmed warning state, 0..3.
    """

    def __init__(self, delta_m: tuple[float, float, float]) -> None:
        self._delta_m = delta_m
        self._rest_m: list[float] = []
        self._raw: deque[int] = deque(maxlen=CONFIRMING_FRAMES)
        self._settling_until_s = -inf
        self._rest_trusted = True
        self.calibration: RestCalibration | None = None
        self.mu_m, self.state = float("nan"), 0

    def rest(self, value_m: float) -> None:
        """Take note of a value while nothing is wrong; one that is not finite teaches nothing."""
        if isfinite(value_m) and len(self._rest_m) < _MAX_REST_FRAMES:
            self._rest_m.append(value_m)

    @property
    def rested(self) -> bool:
        """Whether there are enough rest values to calibrate."""
        return len(self._rest_m) >= MIN_REST_FRAMES

    def calibrate(self) -> None:
        """Learn from the rest values.

        Raises:
            ValueError: there are too few.
        """
        self.calibration = calibrate_rest(self._rest_m, self._delta_m)

    def take(self, value_m: float, stamp_s: float) -> None:
        """The value of a new frame; NaN confirms the state as it is.

        Raises:
            RuntimeError: the metric was not calibrated.
        """
        if self.calibration is None:
            raise RuntimeError("a metric says nothing before it was calibrated on rest values")
        if not self._rest_trusted and value_m < self.calibration.mean_m:
            self.calibration = replace(self.calibration, mean_m=value_m)
        self.mu_m = self.calibration.mu_m(value_m)
        raw = self.state if isnan(value_m) else self.calibration.state(self.mu_m)
        if stamp_s < self._settling_until_s:
            # Tissue and twin agree again: what comes from now on counts.
            self._settling_until_s = stamp_s if raw == 0 else self._settling_until_s
            raw = 0
        self._raw.append(raw)
        self.state = min(self._raw) if len(self._raw) == CONFIRMING_FRAMES else 0

    def distrust_rest(self) -> None:
        """Rest was seen with something wrong that is mended now: from now on the rest value is at
        most what any frame says, so that the mended error hides no other.

        Raises:
            RuntimeError: the metric was not calibrated.
        """
        if self.calibration is None:
            raise RuntimeError("a metric without rest values has none to distrust")
        self._rest_trusted = False

    def settle_until(self, time_s: float) -> None:
        """Raise no state before ``time_s``, or before one frame without any."""
        self._settling_until_s = time_s

    def forget(self) -> None:
        """Forget all frames; the rest values stay."""
        self._raw.clear()
        self.mu_m, self.state = float("nan"), 0
