"""Which boxes in the plane may hold a point: a grid of bins."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Floats

Integers = NDArray[np.int64]

_MOST_BINS_A_SIDE = 400


class Bins:
    """Boxes from ``low`` to ``high``, each (m, 2), sorted into the bins that they touch."""

    def __init__(self, low: Floats, high: Floats) -> None:
        self._low = low.min(axis=0)
        size = np.maximum(high.max(axis=0) - self._low, 1e-12)
        self._count = min(_MOST_BINS_A_SIDE, max(1, int(np.sqrt(len(low)))))
        self._bin = size / self._count
        first, last = self._bins_of(low), self._bins_of(high)
        spans = last - first + 1
        box, within = _counted(spans.prod(axis=1))
        row, column = np.divmod(within, spans[box, 1])
        number = (first[box, 0] + row) * self._count + first[box, 1] + column
        order = np.argsort(number, kind="stable")
        self._boxes = box[order]
        self._starts = np.searchsorted(number[order], np.arange(self._count**2 + 1))

    def candidates(self, points: Floats) -> tuple[Integers, Integers]:
        """Pairs of point and box, (k,) each, among which are all where the point is in the box.

        Pairs of one point follow one another, points in order.
        """
        outside = np.any(
            (points < self._low) | (points > self._low + self._bin * self._count), axis=1
        )
        bins = self._bins_of(points)
        number = bins[:, 0] * self._count + bins[:, 1]
        counts = np.where(outside, 0, self._starts[number + 1] - self._starts[number])
        point, within = _counted(counts)
        return point, self._boxes[self._starts[number[point]] + within]

    def _bins_of(self, points: Floats) -> Integers:
        number = np.floor((points - self._low) / self._bin).astype(np.int64)
        return np.clip(number, 0, self._count - 1)


def _counted(counts: Integers) -> tuple[Integers, Integers]:
    """For each thing i its number, ``counts[i]`` times; and 0, 1, ... within each."""
    thing = np.repeat(np.arange(len(counts)), counts)
    start = np.cumsum(counts) - counts
    return thing, np.arange(len(thing)) - start[thing]
