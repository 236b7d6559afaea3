"""What a set of attachments costs: how badly it explains the shapes, and how new it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Floats


@dataclass(frozen=True)
class SearchSettings:
    """What departing from the belief costs, and how far to trust linearity.

    A cell's squared error counts in units of ``error_m``, the accuracy of the model rather than
    of the camera, and grows only linearly beyond ``robust_m``, where the closest point is likely
    the wrong one. A changed hole has to gain ``change_price`` in those units, and each edge between
    a changed and an unchanged neighbour ``edge_price``: belief errs in patches.

    A free hole under which the tissue moved by less than ``observable_stretch_m``, and an attached
    one far from any that bears ``observable_force_share`` of the largest force, stay as believed.
    """

    error_m: float = 0.001
    robust_m: float = 0.004
    change_price: float = 0.5
    edge_price: float = 0.25
    flips_per_round: int = 6
    observable_stretch_m: float = 0.001
    observable_force_share: float = 0.02


class Cost:
    """Cost of sets around one belief; lower is better, half a squared unit error is 0.5."""

    def __init__(
        self, believed: NDArray[np.bool_], grid: tuple[int, ...], settings: SearchSettings
    ) -> None:
        """``believed`` (holes,) on a ``grid`` of (rows, columns)."""
        self._believed = believed
        self._grid = grid
        self._settings = settings

    def of(self, residuals_m: Sequence[Floats], sets: NDArray[np.bool_]) -> Floats:
        """Cost (b,) of sets (b, holes) with the residuals ([b,] cells) of each frame."""
        s = self._settings
        limit = s.robust_m / s.error_m
        cost = self.price(sets)
        for residual in residuals_m:
            size = np.abs(np.atleast_2d(residual)) / s.error_m
            loss = np.where(size <= limit, 0.5 * size**2, limit * (size - 0.5 * limit))
            cost = cost + loss.sum(axis=1)
        return cost

    def price(self, sets: NDArray[np.bool_]) -> Floats:
        """Price (b,) of departing from the belief: per hole, and per edge of a changed patch."""
        changed = (sets != self._believed).reshape(-1, *self._grid)
        edges = (changed[:, 1:] != changed[:, :-1]).sum(axis=(1, 2))
        edges = edges + (changed[:, :, 1:] != changed[:, :, :-1]).sum(axis=(1, 2))
        s = self._settings
        return s.change_price * changed.sum(axis=(1, 2)) + s.edge_price * edges
