"""From motions of the model's surface to changes of what is compared."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from defras_bt.diagnosis.twins.tissue_cells import FEWEST, AssignedCloud
from defras_bt.diagnosis.twins.tissue_signals import Layout
from defras_bt.learning.misfit import Misfit
from defras_sim.geometry import Floats


@dataclass(frozen=True)
class FrameResponse:
    """One frame's points beside the present model: to first order a closest point that slides
    along the surface changes no distance, so only motion along ``compared.direction`` counts.

    ``compared`` None: the camera would see no tissue, and nothing is known.
    """

    layout: Layout
    cloud: AssignedCloud
    compared: Misfit | None
    vertices: int

    def to_surface(self, surface_by: Floats, forces_by: Mapping[str, Floats]) -> Floats:
        """Change of the predictions (rows, p) with surface vertices moving by ``surface_by``
        (vertices, 3, p) and forces of the jaws changing by ``forces_by`` (3, p)."""
        count = surface_by.shape[2]
        found = np.zeros((self.layout.rows, count))
        cells = len(self.layout.grid)
        if self.compared is None:
            found[:cells] = np.nan
        else:
            found[:cells] = self._matrix(self.compared) @ surface_by.reshape(-1, count)
            found[:cells][self.cloud.count < FEWEST] = np.nan
        for index, arm in enumerate(self.layout.with_force):
            first = cells + 3 * index
            found[first : first + 3] = forces_by.get(arm, np.zeros((3, count)))
        return found

    def to_points(self, moved_m: Floats) -> Floats:
        """Change (rows, p) of the predictions where the model holds that the points truly lie
        ``moved_m`` (n, 3, p) farther along than it held before."""
        found = np.zeros((self.layout.rows, moved_m.shape[2]))
        cells = len(self.layout.grid)
        if self.compared is None:
            found[:cells] = np.nan
        else:
            along = np.einsum("nd,ndp->np", self.compared.direction, moved_m)
            found[:cells] = -self.cloud.means(along)
        return found

    def _matrix(self, compared: Misfit) -> sparse.csr_array:
        """(cells, 3 vertices): mean over each patch's points of the surface's motion along the
        direction in which each is measured."""
        share = compared.weights[:, :, None] * compared.direction[:, None, :]
        share /= np.maximum(self.cloud.count[self.cloud.cell], 1)[:, None, None]
        columns = 3 * compared.vertices[:, :, None] + np.arange(3)
        rows = np.broadcast_to(self.cloud.cell[:, None, None], share.shape)
        shape = (len(self.layout.grid), 3 * self.vertices)
        return sparse.csr_array((share.ravel(), (rows.ravel(), columns.ravel())), shape=shape)
