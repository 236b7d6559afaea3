"""A disc on the tissue, seen from above, in which an effect acts; its rim is soft.

The soft rim gives place and size a derivative, so that both can be fitted.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from defras_sim.effects.effect import EffectParameter, Values
from defras_sim.geometry import Floats

X = EffectParameter(
    "x_m", "m", null=0.0, lower=-0.5, upper=0.5, step=0.01, strength=False,
    meaning="centre of the disc in the tissue frame",
)  # fmt: skip
Y = EffectParameter(
    "y_m", "m", null=0.0, lower=-0.5, upper=0.5, step=0.01, strength=False,
    meaning="centre of the disc in the tissue frame",
)  # fmt: skip
RADIUS = EffectParameter(
    "radius_m", "m", null=0.015, lower=0.003, upper=0.5, step=0.005, strength=False,
    meaning="where the effect is half as strong as in the middle of the disc",
)  # fmt: skip
PLACE = (X, Y, RADIUS)


@dataclass(frozen=True)
class Disc:
    """Centre and radius, and the width over which the effect ends at the rim."""

    x_m: float
    y_m: float
    radius_m: float
    rim_m: float

    @staticmethod
    def of(values: Values, rim_m: float) -> Disc:
        """The disc of an effect's parameters."""
        return Disc(values["x_m"], values["y_m"], values["radius_m"], rim_m)

    @property
    def place(self) -> dict[str, float]:
        """Its parameters."""
        return {"x_m": self.x_m, "y_m": self.y_m, "radius_m": self.radius_m}

    def share(self, xy_m: Floats) -> Floats:
        """How much of the effect acts at places (..., 2): 1 inside, 0 outside (...)."""
        inside = self._inside(xy_m)
        return inside**2 * (3 - 2 * inside)

    def share_by(self, xy_m: Floats) -> dict[str, Floats]:
        """Derivatives (...) [1/m] of the share by the disc's parameters."""
        away = xy_m - np.array([self.x_m, self.y_m])
        distance = np.linalg.norm(away, axis=-1)
        inside = self._inside(xy_m)
        slope = 6 * inside * (1 - inside) / self.rim_m
        outwards = away / np.where(distance > 0, distance, 1.0)[..., None]
        return {
            "x_m": slope * outwards[..., 0],
            "y_m": slope * outwards[..., 1],
            "radius_m": slope,
        }

    def _inside(self, xy_m: Floats) -> Floats:
        distance = np.linalg.norm(xy_m - np.array([self.x_m, self.y_m]), axis=-1)
        return np.clip(0.5 + (self.radius_m - distance) / self.rim_m, 0.0, 1.0)

    def elsewhere(self, xy_m: Floats) -> Iterator[Disc]:
        """Discs of this size that together cover the places (n, 2), centred on a grid.

        Diagonal neighbours touch: nothing lies outside of all, and few discs serve.
        """
        low, high = xy_m.min(axis=0), xy_m.max(axis=0)
        counts = np.maximum(1, np.ceil((high - low) / (np.sqrt(2) * self.radius_m))).astype(int)
        x, y = (
            a + (b - a) * (np.arange(n) + 0.5) / n
            for a, b, n in zip(low, high, counts.tolist(), strict=True)
        )
        for y_m in y.tolist():
            for x_m in x.tolist():
                disc = replace(self, x_m=x_m, y_m=y_m)
                if np.any(disc.share(xy_m) > 0):
                    yield disc
