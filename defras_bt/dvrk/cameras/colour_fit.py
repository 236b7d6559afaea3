"""Ranges of colour from places in a picture that are known to be tissue, or the region."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from defras_bt.dvrk.camera_settings import Hsv
from defras_sim.geometry import Floats

AROUND_PX = 5
"""So far around each place its surroundings are taken for the same."""

_SHARE = 0.01
"""Of the pixels at either end of a range: reflections and specks."""

_MARGINS = (0.02, 0.10, 0.20)
"""Beyond what was seen, of hue, saturation, value: light changes value most and hue least."""


class OutsidePicture(ValueError):
    """A place that is not in the picture."""


def fitted(rgb: NDArray[np.uint8], places: Sequence[tuple[int, int]]) -> Hsv:
    """The range that holds the colours around ``places`` (column, row) of a picture (h, w, 3).

    Raises:
        OutsidePicture: a place is not in the picture.
    """
    height, width = rgb.shape[:2]
    patches = []
    for column, row in places:
        if not (0 <= column < width and 0 <= row < height):
            raise OutsidePicture(
                f"column {column}, row {row} is outside the picture of {width} x {height}"
            )
        rows = slice(max(0, row - AROUND_PX), row + AROUND_PX + 1)
        columns = slice(max(0, column - AROUND_PX), column + AROUND_PX + 1)
        patches.append(rgb[rows, columns].reshape(-1, 3))
    pixels = np.concatenate(patches)[None]
    hsv = np.asarray(Image.fromarray(pixels, "RGB").convert("HSV"), float)[0] / 255.0
    return Hsv(
        hue=_circular(hsv[:, 0], _MARGINS[0]),
        saturation=_straight(hsv[:, 1], _MARGINS[1]),
        value=_straight(hsv[:, 2], _MARGINS[2]),
    )


def _straight(values: Floats, margin: float) -> tuple[float, float]:
    low, high = np.quantile(values, [_SHARE, 1 - _SHARE])
    return round(max(0.0, float(low) - margin), 3), round(min(1.0, float(high) + margin), 3)


def _circular(hues: Floats, margin: float) -> tuple[float, float]:
    """The range around the mean direction, which may run through 1 = 0."""
    turn = np.exp(2j * np.pi * hues).mean()
    middle = float(np.angle(turn)) / (2 * np.pi)
    away = (hues - middle + 0.5) % 1.0 - 0.5
    low, high = np.quantile(away, [_SHARE, 1 - _SHARE])
    if high - low + 2 * margin >= 1.0:
        return 0.0, 1.0
    return (
        round((middle + float(low) - margin) % 1.0, 3),
        round((middle + float(high) + margin) % 1.0, 3),
    )
