"""A box of 20-node hexahedra whose layers differ in thickness: fine here, coarse there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.tissue.elements import Quadrature, quadrature
from defras_sim.tissue.mesh import Integers, Mesh, hexahedral_lattice


@dataclass(frozen=True)
class GradedMesh(Mesh):
    """``breaks_m``: where the layers of elements meet, along x, y and z, ascending."""

    breaks_m: tuple[Floats, Floats, Floats]

    @property
    def quadrature(self) -> Quadrature:
        x, y, z = (len(breaks) - 1 for breaks in self.breaks_m)
        return quadrature(self.element, (x, y, z))

    def locate(self, points_m: Floats) -> tuple[Integers, Floats]:
        layers, inside = [], []
        for axis, breaks in enumerate(self.breaks_m):
            at = points_m[:, axis]
            if np.any(at < breaks[0] - 1e-9) or np.any(at > breaks[-1] + 1e-9):
                raise ValueError(f"a point lies outside the box, which ends at {breaks[[0, -1]]} m")
            layer = np.clip(np.searchsorted(breaks, at, side="right") - 1, 0, len(breaks) - 2)
            share = (at - breaks[layer]) / (breaks[layer + 1] - breaks[layer])
            layers.append(layer)
            inside.append(np.clip(2 * share - 1, -1.0, 1.0))
        nx, ny = len(self.breaks_m[0]) - 1, len(self.breaks_m[1]) - 1
        number = (layers[2] * ny + layers[1]) * nx + layers[0]
        return number.astype(np.int64), np.stack(inside, axis=1)


def graded_mesh(breaks_m: tuple[Floats, Floats, Floats]) -> GradedMesh:
    """The box between the first and the last break along each axis."""
    counts = np.array([len(breaks) - 1 for breaks in breaks_m])
    lattice, connectivity = hexahedral_lattice(counts)
    nodes = np.stack(
        [
            np.interp(lattice[:, axis], np.arange(0, 2 * counts[axis] + 1, 2), breaks)
            for axis, breaks in enumerate(breaks_m)
        ],
        axis=1,
    )
    return GradedMesh("hexahedron20", nodes, connectivity, breaks_m)


def graded_breaks(
    low_m: float, high_m: float, center_m: float, finest_m: float, core_m: float, growth: float
) -> Floats:
    """Breaks from ``low_m`` to ``high_m``: layers of about ``finest_m`` within ``core_m`` of the
    centre, each ``growth`` times as thick as the one before farther out."""
    below = _layers(center_m - low_m, finest_m, core_m, growth)
    above = _layers(high_m - center_m, finest_m, core_m, growth)
    return np.concatenate([center_m - below[:0:-1], center_m + above])


def _layers(length_m: float, finest_m: float, core_m: float, growth: float) -> Floats:
    """Distances from 0 to ``length_m``; just [0] if that is no distance."""
    if length_m < 1e-9:
        return np.zeros(1)
    ends, layer = [0.0], finest_m
    while ends[-1] < length_m:
        if ends[-1] >= core_m:
            layer *= growth
        ends.append(ends[-1] + layer)
    if len(ends) > 2 and ends[-1] - length_m > length_m - ends[-2]:
        ends.pop()
    return np.array(ends) * (length_m / ends[-1])
