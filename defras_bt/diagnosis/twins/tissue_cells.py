"""Where on the tissue observed points lie, and how far off the model's surface they are there.

Points are assigned once, to the nearest place of the surface that the plain model predicts for
their frame, and belong to that patch of tissue whatever model they are compared with later. So the
same numbers are compared throughout, and a better model cannot choose its own data.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defras_bt.learning.misfit import Misfit, misfit
from defras_sim.geometry import Floats
from defras_sim.scene import Camera, Tissue
from defras_sim.surface import Surface

Integers = NDArray[np.int64]

FEWEST = 4
"""A patch with fewer points in a frame says nothing about it."""


@dataclass(frozen=True)
class CellGrid:
    """Patches of tissue: ``upper`` x ``upper`` of its upper face and ``lower`` x ``lower`` of its
    lower face, which shows where the tissue is folded over. Numbered upper ones first, x fastest.
    """

    length_m: float
    width_m: float
    upper: int = 8
    lower: int = 4

    @staticmethod
    def over(tissue: Tissue) -> CellGrid:
        return CellGrid(tissue.length_x_m, tissue.width_y_m)

    def __len__(self) -> int:
        return self.upper**2 + self.lower**2

    @property
    def names(self) -> tuple[str, ...]:
        """Column and row count from 1 at the smallest x and y, as those of grasp points do."""

        def of(face: str, count: int) -> list[str]:
            return [f"{face} {x + 1},{y + 1}" for y in range(count) for x in range(count)]

        return (*of("upper", self.upper), *of("lower", self.lower))

    @property
    def places_m(self) -> Floats:
        """Centres (cells, 2) on the resting tissue, seen from above."""

        def of(count: int) -> Floats:
            x = ((np.arange(count) + 0.5) / count - 0.5) * self.length_m
            y = ((np.arange(count) + 0.5) / count - 0.5) * self.width_m
            return np.stack([np.tile(x, count), np.repeat(y, count)], axis=1)

        return np.concatenate([of(self.upper), of(self.lower)])

    def cells(self, rest_xy_m: Floats, is_upper: NDArray[np.bool_]) -> Integers:
        """Cell (n,) of places (n, 2) on the resting tissue."""
        size = np.array([self.length_m, self.width_m])
        share = np.clip(rest_xy_m / size + 0.5, 0.0, 1.0 - 1e-9)

        def of(count: int) -> Integers:
            at = (share * count).astype(np.int64)
            return np.asarray(at[:, 1] * count + at[:, 0])

        return np.where(is_upper, of(self.upper), self.upper**2 + of(self.lower))


@dataclass(frozen=True)
class AssignedCloud:
    """Points (n, 3) of one cloud with the cell (n,) that each belongs to, and how many each has."""

    points_m: Floats
    cell: Integers
    count: Integers

    @staticmethod
    def to(surface: Surface, camera: Camera, grid: CellGrid, points_m: Floats) -> AssignedCloud:
        """Assign ``points_m`` (n, 3) to what ``camera`` sees of ``surface``."""
        compared = misfit(points_m, surface, camera)
        if compared is None:
            return AssignedCloud(
                np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros(len(grid), np.int64)
            )
        rest = np.einsum("nk,nkd->nd", compared.weights, surface.rest_xy_m[compared.vertices])
        is_upper = np.asarray(surface.upper[compared.vertices].any(axis=1), bool)
        cell = grid.cells(rest, is_upper)
        return AssignedCloud(points_m, cell, np.bincount(cell, minlength=len(grid)))

    def means(self, values: Floats) -> Floats:
        """Mean over the points of each cell: (cells, ...) of (n, ...); NaN where points are few."""
        flat = values.reshape(len(values), -1)
        size = len(self.count)
        sums = np.stack(
            [np.bincount(self.cell, weights=column, minlength=size) for column in flat.T], axis=1
        )
        with np.errstate(invalid="ignore", divide="ignore"):
            mean = sums / self.count[:, None]
        mean[self.count < FEWEST] = np.nan
        return np.asarray(mean.reshape(size, *values.shape[1:]))

    def compared(self, points_m: Floats, surface: Surface, camera: Camera) -> Misfit | None:
        """Its points, brought to ``points_m`` (n, 3) by camera effects, beside a model."""
        return misfit(points_m, surface, camera) if len(points_m) else None

    def residual_m(self, points_m: Floats, surface: Surface, camera: Camera) -> Floats:
        """Mean signed distance (cells,) off the visible ``surface``, positive outside the tissue.

        NaN for cells that are not seen, and everywhere where the camera would see no tissue.
        """
        compared = self.compared(points_m, surface, camera)
        if compared is None:
            return np.full(len(self.count), np.nan)
        return self.means(compared.residual_m)
