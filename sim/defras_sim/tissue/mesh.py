"""Finite-element meshes of the slab, and where a material point lies in them.

The slab is a box in the tissue frame: upper face at z = 0, lower face at z = -thickness.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from defras_sim.geometry import Floats
from defras_sim.scene import ElementName, Tissue
from defras_sim.tissue.elements import (
    HEXAHEDRON20_NODES,
    Quadrature,
    quadrature,
    shape_values,
)
from defras_sim.tissue.tetrahedra import with_edge_middles

Integers = NDArray[np.int64]

# Kuhn's split: each tetrahedron walks from corner 000 to corner 111 of its cell along three edges,
# in one of the six orders of the axes. Neighbouring cells meet in the same diagonals.
_KUHN_ORDERS = ((0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2))


@dataclass(frozen=True)
class Mesh(ABC):
    """Rest positions ``nodes_m`` (n, 3) and ``connectivity`` (elements, nodes of an element)."""

    element: ElementName
    nodes_m: Floats
    connectivity: Integers

    @property
    @abstractmethod
    def quadrature(self) -> Quadrature:
        """The rule that the tissue model integrates with."""

    @abstractmethod
    def locate(self, points_m: Floats) -> tuple[Integers, Floats]:
        """Element (n,) and reference coordinates (n, 3) of rest points (n, 3).

        Raises:
            ValueError: a point lies outside the tissue.
        """

    def interpolation(self, points_m: Floats) -> sparse.csr_array:
        """Matrix (points, nodes) that interpolates nodal values at rest points (points, 3).

        Raises:
            ValueError: a point lies outside the tissue.
        """
        elements, local = self.locate(np.asarray(points_m, dtype=float))
        values = shape_values(self.element, local)
        columns = self.connectivity[elements]
        rows = np.repeat(np.arange(len(values)), values.shape[1])
        shape = (len(values), len(self.nodes_m))
        keep = np.abs(values.ravel()) > 1e-13
        entries = (values.ravel()[keep], (rows[keep], columns.ravel()[keep]))
        return sparse.csr_array(entries, shape=shape)


@dataclass(frozen=True)
class SlabMesh(Mesh):
    """A box of ``cells_xyz`` cells of ``cell_m`` (3,), the first at ``origin_m`` (3,)."""

    origin_m: Floats
    cell_m: Floats
    cells_xyz: tuple[int, int, int]

    @property
    def quadrature(self) -> Quadrature:
        return quadrature(self.element, self.cells_xyz)

    def locate(self, points_m: Floats) -> tuple[Integers, Floats]:
        scaled = (points_m - self.origin_m) / self.cell_m
        counts = np.array(self.cells_xyz)
        if np.any(scaled < -1e-9) or np.any(scaled > counts + 1e-9):
            worst = points_m[np.argmax(np.abs(scaled / counts - 0.5).max(axis=1))]
            raise ValueError(f"point {worst} m lies outside the slab")
        cell = np.clip(scaled.astype(np.int64), 0, counts - 1)
        inside = np.clip(scaled - cell, 0.0, 1.0)
        number = (cell[:, 2] * counts[1] + cell[:, 1]) * counts[0] + cell[:, 0]
        if self.element == "hexahedron20":
            return number, 2 * inside - 1
        # In a Kuhn tetrahedron the coordinates fall along its axis order; its reference
        # coordinates are their successive differences.
        order = np.argsort(-inside, axis=1, kind="stable")
        falling = np.take_along_axis(inside, order, axis=1)
        local = np.column_stack(
            [falling[:, 0] - falling[:, 1], falling[:, 1] - falling[:, 2], falling[:, 2]]
        )
        kind = np.array([_KUHN_ORDERS.index(tuple(row)) for row in order.tolist()])
        odd = kind >= 3  # stored with their last two corners exchanged, for positive volume
        local[odd] = local[odd][:, [0, 2, 1]]
        return number * 6 + kind, local


def slab_mesh(tissue: Tissue, element: ElementName, elements_xyz: tuple[int, int, int]) -> SlabMesh:
    """The slab of ``tissue`` cut into ``elements_xyz`` cells."""
    if element == "hexahedron20":
        nodes, connectivity = _hexahedral_slab(tissue, elements_xyz)
    else:
        nodes, connectivity = tetrahedral_slab(tissue, elements_xyz)
    if element == "tetrahedron10":
        nodes, connectivity = with_edge_middles(nodes, connectivity)
    size, origin = _box(tissue)
    cell = size / np.array(elements_xyz)
    return SlabMesh(element, nodes, connectivity, origin, cell, elements_xyz)


def tetrahedral_slab(tissue: Tissue, elements_xyz: tuple[int, int, int]) -> tuple[Floats, Integers]:
    """Nodes (n, 3) and tetrahedra (6 a cell, 4) of positive volume, the same for every user."""
    size, origin = _box(tissue)
    counts = np.array(elements_xyz)
    lattice = _lattice(counts + 1)
    cells = _lattice(counts)
    connectivity = np.empty((len(cells), 6, 4), dtype=np.int64)
    for kind, order in enumerate(_KUHN_ORDERS):
        corner = cells.copy()
        path = [_number(corner, counts + 1)]
        for axis in order:
            corner[:, axis] += 1
            path.append(_number(corner, counts + 1))
        if kind >= 3:
            path[2], path[3] = path[3], path[2]
        connectivity[:, kind] = np.stack(path, axis=1)
    return origin + lattice * (size / counts), connectivity.reshape(-1, 4)


def hexahedral_lattice(counts: Integers) -> tuple[Integers, Integers]:
    """Nodes (n, 3) of 20-node hexahedra stacked ``counts`` (3,) times along x, y and z, in half
    elements from the first corner, and connectivity (elements, 20)."""
    fine = 2 * counts + 1  # lattice of corners and middles; the serendipity element has no others
    cells = _lattice(counts)
    offsets = (HEXAHEDRON20_NODES + 1).astype(np.int64)
    corners = 2 * cells[:, None, :] + offsets[None]
    numbers = _number(corners.reshape(-1, 3), fine)
    used, connectivity = np.unique(numbers, return_inverse=True)
    return _lattice(fine)[used], connectivity.reshape(len(cells), 20).astype(np.int64)


def _hexahedral_slab(tissue: Tissue, elements_xyz: tuple[int, int, int]) -> tuple[Floats, Integers]:
    size, origin = _box(tissue)
    counts = np.array(elements_xyz)
    lattice, connectivity = hexahedral_lattice(counts)
    return origin + lattice * (size / (2 * counts)), connectivity


def _box(tissue: Tissue) -> tuple[Floats, Floats]:
    size = np.array([tissue.length_x_m, tissue.width_y_m, tissue.thickness_m])
    return size, np.array([-size[0] / 2, -size[1] / 2, -size[2]])


def _lattice(counts: Integers) -> Integers:
    """All integer points (n, 3) below ``counts``, x fastest."""
    z, y, x = np.meshgrid(*(np.arange(c) for c in counts[::-1]), indexing="ij")
    return np.stack([x, y, z], axis=-1).reshape(-1, 3)


def _number(lattice: Integers, counts: Integers) -> Integers:
    return (lattice[..., 2] * counts[1] + lattice[..., 1]) * counts[0] + lattice[..., 0]
