"""Mirrored and turned tissue: what the sequence network is told of it.

Tissue mechanics knows no left or right, so every sample is also one of its mirror images.
"""

from __future__ import annotations

import torch
from torch import Tensor

from defras_bt.learning.networks.hole_features import FRAME_CHANNELS, HOLE_CHANNELS


def _signs(names: tuple[str, ...], axis: str) -> Tensor:
    """-1 for components of vectors along ``axis``; distances to the rim have no direction."""
    return torch.tensor(
        [-1.0 if n.endswith(f"_{axis}") and not n.startswith("rim") else 1.0 for n in names]
    )


def _swapped(names: tuple[str, ...]) -> list[int]:
    """For each channel the one that stands in its place when x and y are exchanged."""
    other = {"x": "y", "y": "x"}
    partner = [n[:-1] + other[n[-1]] if n[-2:] in ("_x", "_y") else n for n in names]
    return [names.index(name) for name in partner]


def mirrored(
    frames: Tensor, holes: Tensor, labels: Tensor, *, x: bool, y: bool, swap: bool
) -> tuple[Tensor, Tensor, Tensor]:
    """``frames`` (b, f, c, rows, columns), ``holes`` (b, c, rows, columns) and ``labels``
    (b, rows, columns) with x or y mirrored, and then both axes exchanged."""
    for wanted, axis, dim in ((x, "x", -1), (y, "y", -2)):
        if wanted:
            sign = _signs(FRAME_CHANNELS, axis).to(frames)
            frames = frames.flip(dim) * sign.view(-1, 1, 1)
            sign = _signs(HOLE_CHANNELS, axis).to(holes)
            holes = holes.flip(dim) * sign.view(-1, 1, 1)
            labels = labels.flip(dim)
    if swap:
        frames = frames[:, :, _swapped(FRAME_CHANNELS)].transpose(-1, -2)
        holes = holes[:, _swapped(HOLE_CHANNELS)].transpose(-1, -2)
        labels = labels.transpose(-1, -2)
    return frames, holes, labels
