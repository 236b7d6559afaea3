"""Which colours belong to what in a camera's pictures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image


@dataclass(frozen=True)
class HsvRange:
    """A box in hue, saturation and value, each from 0 to 1.

    The hue is a circle: ``hue=(0.95, 0.05)`` is the range through red. Shading changes value
    far more than hue, so a range should be narrow in hue and wide in value.
    """

    hue: tuple[float, float] = (0.0, 1.0)
    saturation: tuple[float, float] = (0.0, 1.0)
    value: tuple[float, float] = (0.0, 1.0)

    def __post_init__(self) -> None:
        for name in ("hue", "saturation", "value"):
            low, high = getattr(self, name)
            if not (0.0 <= low <= 1.0 and 0.0 <= high <= 1.0):
                raise ValueError(f"{name} range ({low}, {high}) should lie within 0 to 1")
            if name != "hue" and low > high:
                raise ValueError(f"{name} range ({low}, {high}) is empty; give the smaller first")

    def mask(self, rgb: NDArray[np.uint8]) -> NDArray[np.bool_]:
        """Which pixels (h, w) of a picture (h, w, 3) have a colour in the range."""
        picture = np.asarray(Image.fromarray(rgb, "RGB").convert("HSV"), np.float32) / 255.0
        hue, saturation, value = np.moveaxis(picture, -1, 0)
        first, last = self.hue
        after, before = hue >= first, hue <= last
        found = after & before if first <= last else after | before
        found &= (saturation >= self.saturation[0]) & (saturation <= self.saturation[1])
        found &= (value >= self.value[0]) & (value <= self.value[1])
        return found


@dataclass(frozen=True)
class ColourCalibration:
    """Colours of the tissue and of the region of interest under a set-up's light.

    Whatever has neither colour (instruments, bed, background) is left out of both.
    """

    tissue: HsvRange = HsvRange(hue=(0.92, 0.12), saturation=(0.15, 1.0), value=(0.12, 1.0))
    roi: HsvRange = HsvRange(hue=(0.25, 0.45), saturation=(0.35, 1.0), value=(0.12, 1.0))


DEFAULT_COLOURS = ColourCalibration()
"""Fits the simulated cameras (``defras_sim.worlds.colours``): reddish tissue, green region."""
