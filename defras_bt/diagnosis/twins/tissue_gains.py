"""How much of what was measured a change of the predictions would explain, at first sight."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from defras_bt.diagnosis.problem import Tangent
from defras_bt.diagnosis.twins.tissue_part import TissuePart
from defras_sim.geometry import Floats


class Gains:
    """Beside the residual of ``parts``, each row in units of its ``tolerance`` (rows,)."""

    def __init__(self, parts: Sequence[TissuePart], tolerance: Floats) -> None:
        self._scale = np.concatenate([np.repeat(tolerance, part.shape[1]) for part in parts])
        residual = np.concatenate([part.residual.ravel() for part in parts])
        self._residual = np.nan_to_num(residual / self._scale)

    @property
    def whole(self) -> float:
        """The residual's squares."""
        return float(self._residual @ self._residual)

    def of(self, column: Floats) -> float:
        """Squares that a column (n,) explains in its own direction, and none against it."""
        scaled: Floats = np.nan_to_num(column / self._scale)
        along = max(float(scaled @ self._residual), 0.0)
        return along**2 / max(float(scaled @ scaled), 1e-12)

    def best(self, tangents: Sequence[Tangent], share: float) -> list[Tangent]:
        """Those that explain more than a ``share`` of the residual with their first column, the
        best first."""
        gains = [self.of(tangent.columns[:, 0]) for tangent in tangents]
        order = np.argsort([-gain for gain in gains], kind="stable")
        return [tangents[i] for i in order if gains[i] > share * self.whole]
