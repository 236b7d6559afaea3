"""Observed points averaged over small cubes: what the search fits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from defras_bt.learning.hold_out import Cells
from defras_bt.learning.misfit import Misfit
from defras_sim.geometry import Floats
from defras_sim.tissue.hole_response import HoleResponse

MIN_POINTS = 3


@dataclass(frozen=True)
class ObservedCells:
    """Points (n, 3) of one frame, and the matrix (cells, n) that averages them cube by cube.

    Errors of neighbouring points are alike, so a cube counts as one observation; its mean takes
    most of the camera's noise away.
    """

    points_m: Floats
    mean: sparse.csr_array

    @staticmethod
    def of(points_m: Floats) -> ObservedCells:
        """Cubes with fewer than 3 points are left out."""
        _, cell, count = np.unique(Cells.of(points_m).key, return_inverse=True, return_counts=True)
        enough = count[cell] >= MIN_POINTS
        points, cell = points_m[enough], cell[enough]
        _, cell, count = np.unique(cell, return_inverse=True, return_counts=True)
        entries = (1.0 / count[cell], (cell, np.arange(len(points))))
        return ObservedCells(points, sparse.csr_array(entries, shape=(len(count), len(points))))

    def residual_m(self, compared: Misfit) -> Floats:
        """Mean signed distance of each cell (cells,)."""
        return np.asarray(self.mean @ compared.residual_m)

    def jacobian(self, compared: Misfit, response: HoleResponse) -> Floats:
        """Derivative (cells, holes, 9) of :meth:`residual_m` by the force at each hole."""
        surface = response.surface_m_per_n
        flat = surface.reshape(*surface.shape[:2], -1)
        cells = np.asarray(self.mean @ compared.jacobian(flat))
        return cells.reshape(len(cells), *surface.shape[2:])
