"""Colour ranges, with the hue as a circle."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.sensing.colours import DEFAULT_COLOURS, HsvRange
from defras_sim.worlds import colours


def pixel(*rgb: int) -> np.ndarray:
    return np.array([[rgb]], np.uint8)


def test_a_range_through_red_wraps_around() -> None:
    red = HsvRange(hue=(0.95, 0.05), saturation=(0.5, 1.0))
    assert red.mask(pixel(255, 20, 0)).item()
    assert red.mask(pixel(255, 0, 20)).item()
    assert not red.mask(pixel(0, 255, 0)).item()
    assert not red.mask(pixel(128, 128, 128)).item()


@pytest.mark.parametrize("light", [1.0, 0.7, 0.4, 0.2])
def test_the_default_colours_tell_the_simulated_ones_apart_in_any_light(light: float) -> None:
    tissue, roi = DEFAULT_COLOURS.tissue, DEFAULT_COLOURS.roi
    for colour, is_tissue, is_roi in (
        (colours.TISSUE, True, False),
        (colours.ROI, False, True),
        (colours.BED, False, False),
        ((0.6, 0.6, 0.62), False, False),
    ):
        lit = pixel(*(int(255 * light * channel) for channel in colour))
        assert tissue.mask(lit).item() == is_tissue
        assert roi.mask(lit).item() == is_roi


def test_an_impossible_range_is_refused() -> None:
    with pytest.raises(ValueError, match="should lie within 0 to 1"):
        HsvRange(hue=(0.0, 180.0))
    with pytest.raises(ValueError, match="is empty"):
        HsvRange(value=(0.8, 0.2))
