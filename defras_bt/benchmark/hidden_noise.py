"""Sensor noise unlike the one that any twin assumes: it remembers, it drifts, it drops out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.scene import Camera


@dataclass(frozen=True)
class NoiseSpectrum:
    """Errors of a depth camera along its rays, and of a force sensor.

    ``white_m`` is each point's own; ``patch_m`` a smooth error field over the picture that is kept
    from cloud to cloud to the share ``memory``, as structured light and stereo matching make it;
    ``drift_m`` warms up over ``drift_s``. ``drop_out``: share of clouds that never come.
    ``force_n`` is white, ``force_wander_n`` remembers.
    """

    white_m: float = 0.0006
    patch_m: float = 0.00025
    memory: float = 0.85
    drift_m: float = 0.00015
    drift_s: float = 12.0
    drop_out: float = 0.04
    force_n: float = 0.002
    force_wander_n: float = 0.0008


class CameraNoise:
    """The depth camera's errors, one cloud after the other."""

    _SIDE = 6

    def __init__(self, spectrum: NoiseSpectrum, camera: Camera, rng: np.random.Generator) -> None:
        self._spectrum = spectrum
        self._eye_m = np.array(camera.position_m)
        self._rng = rng
        self._field = rng.standard_normal((self._SIDE, self._SIDE))
        self._drift = rng.choice([-1.0, 1.0]) * spectrum.drift_m

    def on(self, points_m: Floats, time_s: float) -> Floats | None:
        """Points (n, 3) as reported; None where the cloud is lost."""
        s = self._spectrum
        new = np.sqrt(1 - s.memory**2) * self._rng.standard_normal(self._field.shape)
        self._field = s.memory * self._field + new
        if self._rng.random() < s.drop_out:
            return None
        rays = points_m - self._eye_m
        depth = np.linalg.norm(rays, axis=1)
        error = s.white_m * self._rng.standard_normal(len(points_m))
        error += s.patch_m * self._over_picture(points_m)
        error += self._drift * (1 - np.exp(-time_s / s.drift_s))
        return np.asarray(points_m + rays / depth[:, None] * error[:, None])

    def _over_picture(self, points_m: Floats) -> Floats:
        """The smooth field (n,) where the points stand, seen from above."""
        low, high = points_m[:, :2].min(axis=0), points_m[:, :2].max(axis=0)
        at = (points_m[:, :2] - low) / np.maximum(high - low, 1e-9) * (self._SIDE - 1)
        cell = np.minimum(at.astype(int), self._SIDE - 2)
        u, v = (at - cell).T
        i, j = cell.T
        f = self._field
        return np.asarray(
            (1 - u) * (1 - v) * f[i, j]
            + u * (1 - v) * f[i + 1, j]
            + (1 - u) * v * f[i, j + 1]
            + u * v * f[i + 1, j + 1]
        )


class ForceNoise:
    """A force sensor's errors, one reading after the other."""

    def __init__(self, spectrum: NoiseSpectrum, rng: np.random.Generator) -> None:
        self._spectrum = spectrum
        self._rng = rng
        self._wander = spectrum.force_wander_n * rng.standard_normal(3)

    def on(self, force_n: Floats) -> Floats:
        """A force (3,) as reported."""
        s = self._spectrum
        memory = 0.97
        step = np.sqrt(1 - memory**2) * s.force_wander_n * self._rng.standard_normal(3)
        self._wander = memory * self._wander + step
        return np.asarray(force_n + self._wander + s.force_n * self._rng.standard_normal(3))
