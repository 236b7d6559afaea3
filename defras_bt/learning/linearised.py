"""Predicts what flipping any set of holes does to the misfit of one frame, without a solve.

At an equilibrium the tissue answers linearly to small forces. A hole that starts to hold with
stiffness k adds the force that a spring there would exert on the *changed* tissue, one that lets go
takes its force away. For changed holes q with stiffness changes dk, stretch u and compliance C:

    force = -(1/dk + C_qq)^-1 u_q        residual' = residual + J_q force

which is exact for linear tissue and any dk (Sherman-Morrison-Woodbury), and good to a few tenths
of the change for the large displacements seen here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Floats

Indices = NDArray[np.int64]

# Instead of leaving unchanged holes out of a block, their spring is changed by next to nothing.
_NO_CHANGE_M_PER_N = 1e12


@dataclass(frozen=True)
class LinearisedFrame:
    """One frame around one set of holding holes.

    ``residual_m`` (cells,) are mean signed distances; ``jacobian`` (cells, holes, d) [m/N],
    ``compliance`` (holes, d, holes, d) [m/N] and ``stretch_m`` (holes, d) as in the text above,
    with d numbers held by each hole.
    """

    residual_m: Floats
    jacobian: Floats
    compliance: Floats
    stretch_m: Floats

    def predict(self, blocks: Indices, stiffness_change: Floats) -> Floats:
        """Residuals (blocks, cells) after changing each block of holes on its own.

        ``blocks`` (b, q) lists holes, ``stiffness_change`` (b, q) [N/m] what their springs gain;
        0 leaves a hole as it is.
        """
        count, cells = len(blocks), len(self.residual_m)
        force = self._forces(blocks, stiffness_change)
        jacobian = np.moveaxis(self.jacobian[:, blocks], 0, 1).reshape(count, cells, -1)
        return self.residual_m + (jacobian @ force[:, :, None])[:, :, 0]

    def changed(self, holes: Indices, stiffness_change: Floats) -> LinearisedFrame:
        """The same linear tissue with the stiffness of ``holes`` (q,) changed."""
        each = self.stretch_m.shape[1]
        size, count = each * len(holes), self.stretch_m.size
        spring = np.diag(np.repeat(1.0 / stiffness_change, each))
        compliance = self.compliance.reshape(count, count)
        own = self.compliance[holes][:, :, holes].reshape(size, size)
        from_holes = self.compliance[holes].reshape(size, count)
        to_holes = self.compliance[:, :, holes].reshape(count, size)
        on_cells = self.jacobian[:, holes].reshape(-1, size)
        jacobian = self.jacobian.reshape(-1, count)
        gain = np.linalg.inv(spring + own)
        force = -gain @ self.stretch_m[holes].ravel()
        return LinearisedFrame(
            self.residual_m + on_cells @ force,
            (jacobian - on_cells @ gain @ from_holes).reshape(self.jacobian.shape),
            (compliance - to_holes @ gain @ from_holes).reshape(self.compliance.shape),
            self.stretch_m + (to_holes @ force).reshape(-1, each),
        )

    def _forces(self, blocks: Indices, stiffness_change: Floats) -> Floats:
        """Forces (blocks, d q) that the changes put on the tissue."""
        each = self.stretch_m.shape[1]
        count, size = len(blocks), each * blocks.shape[1]
        steady = stiffness_change == 0.0
        spring = np.where(steady, _NO_CHANGE_M_PER_N, 1.0 / np.where(steady, 1.0, stiffness_change))
        own = self.compliance[blocks[:, :, None], :, blocks[:, None, :], :]
        system = np.moveaxis(own, 3, 2).reshape(count, size, size).copy()
        diagonal = np.arange(size)
        system[:, diagonal, diagonal] += np.repeat(spring, each, axis=1)
        pull = self.stretch_m[blocks].reshape(count, size)
        force = np.asarray(np.linalg.solve(system, pull[:, :, None]), float)
        return -force[:, :, 0]
