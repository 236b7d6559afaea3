"""Colours that the timeline and the report share: red, green, blue in 0..255."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Floats

Rgb = tuple[int, int, int]

TISSUE: Rgb = (222, 128, 116)
TWIN: Rgb = (74, 134, 232)
ROI: Rgb = (22, 190, 140)
BED: Rgb = (70, 104, 112)
BELIEVED: Rgb = (37, 99, 210)
ACTUAL: Rgb = (204, 60, 50)
ARMS: dict[str, Rgb] = {"psm1": (96, 72, 176), "psm2": (214, 138, 16)}
ESTIMATED: Rgb = (46, 124, 232)
TRUE: Rgb = (140, 144, 152)
MEDIAN: Rgb = (160, 116, 208)
INK: Rgb = (38, 44, 52)
MUTED: Rgb = (138, 146, 156)

WARNING_STATES: tuple[Rgb, Rgb, Rgb, Rgb] = (
    (120, 190, 140),
    (240, 196, 66),
    (238, 132, 50),
    (204, 50, 50),
)
OPERATOR_MODES: dict[str, Rgb] = {
    "autonomous": (206, 212, 220),
    "paused": (240, 196, 66),
    "taken_over": (150, 110, 210),
    "stopped": (204, 50, 50),
}
NODE_STATES: dict[str, Rgb] = {
    "RUNNING": (74, 134, 232),
    "SUCCESS": (92, 176, 118),
    "FAILURE": (178, 184, 192),
}
ACTIONS: dict[str, Rgb] = {
    "reach": (150, 160, 200),
    "open": (190, 196, 206),
    "grasp": (128, 110, 200),
    "pull": (88, 150, 220),
    "move": (70, 176, 196),
    "fold": (40, 170, 140),
    "release": (200, 170, 120),
}
EVENT_LEVELS: dict[str, Rgb] = {
    "info": (70, 80, 92),
    "warning": (200, 120, 10),
    "error": (196, 44, 44),
}

_DISCREPANCY = np.array([(236, 238, 240), (246, 206, 70), (238, 132, 50), (190, 30, 40)], float)


def css(colour: Rgb) -> str:
    """``#rrggbb``."""
    return "#{:02x}{:02x}{:02x}".format(*colour)


def discrepancy_colours(distance_m: Floats, delta_m: tuple[float, ...]) -> NDArray[np.uint8]:
    """Colours (n, 3): pale at 0, yellow, orange and red at delta1, delta2, delta3 and beyond.

    A distance that is not a number is drawn as the worst.
    """
    distance_m = np.nan_to_num(distance_m, nan=delta_m[-1])
    stops = np.array([0.0, *delta_m])
    channels = [np.interp(distance_m, stops, _DISCREPANCY[:, i]) for i in range(3)]
    return np.stack(channels, axis=-1).astype(np.uint8)
