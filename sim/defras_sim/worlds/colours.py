"""Colours of the simulated operating field, 0..1 RGB: what a colour calibration has to find."""

from __future__ import annotations

Rgb = tuple[float, float, float]

TISSUE: Rgb = (0.93, 0.62, 0.42)
ROI: Rgb = (0.10, 0.72, 0.30)
BED: Rgb = (0.32, 0.36, 0.46)
