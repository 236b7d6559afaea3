"""The tissue's surface as triangles, interpolated from the nodes of any mesh.

The triangles are the same whatever the mesh, so that surfaces of different meshes compare point by
point, and small enough to follow the curved faces of quadratic elements.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from defras_sim.anatomy.anatomy import Anatomy
from defras_sim.geometry import Floats
from defras_sim.scene import Tissue
from defras_sim.surface import Surface
from defras_sim.tissue.mesh import Integers, Mesh

SQUARES = 24  # along each side of the upper and the lower face


@dataclass(frozen=True)
class SurfaceMap:
    """``from_nodes`` (vertices, nodes) interpolates the vertices of ``triangles``. ``upper`` marks
    those of the upper face; ``rest_xy_m`` (vertices, 2) is where they lie at rest."""

    from_nodes: sparse.csr_array
    triangles: Integers
    upper: NDArray[np.bool_]
    rest_xy_m: Floats

    def surface(self, positions_m: Floats) -> Surface:
        """The surface of the tissue whose nodes lie at ``positions_m`` (nodes, 3)."""
        vertices = self.from_nodes @ positions_m
        return Surface(vertices, self.triangles, self.upper, self.rest_xy_m)


def surface_map(mesh: Mesh, tissue: Tissue) -> SurfaceMap:
    """The surface of a scene's tissue on any of its meshes."""
    return _slab_map(mesh, tissue) if tissue.anatomy is None else _map(mesh, tissue.anatomy)


def _map(mesh: Mesh, anatomy: Anatomy) -> SurfaceMap:
    rest = anatomy.surface
    from_nodes = mesh.interpolation(rest.vertices_m)
    return SurfaceMap(from_nodes, rest.triangles, rest.upper, rest.rest_xy_m)


def _slab_map(mesh: Mesh, tissue: Tissue) -> SurfaceMap:
    """Both faces as a grid of squares, joined by one row of side squares."""
    count = SQUARES + 1
    x = np.linspace(-tissue.length_x_m / 2, tissue.length_x_m / 2, count)
    y = np.linspace(-tissue.width_y_m / 2, tissue.width_y_m / 2, count)
    xy = np.stack([np.tile(x, count), np.repeat(y, count)], axis=1)
    below = np.full(len(xy), -tissue.thickness_m)
    points = np.concatenate(
        [np.column_stack([xy, np.zeros(len(xy))]), np.column_stack([xy, below])]
    )
    upper = np.arange(len(points)) < len(xy)
    triangles = _grid_triangles(count)
    sides = _side_triangles(count, len(xy))
    lower = triangles[:, ::-1] + len(xy)
    everything = np.concatenate([triangles, lower, sides])
    return SurfaceMap(mesh.interpolation(points), everything, upper, np.concatenate([xy, xy]))


def _grid_triangles(count: int) -> Integers:
    """Upward triangles of the upper face; alternating diagonals favour no direction."""
    i, j = np.meshgrid(np.arange(count - 1), np.arange(count - 1))
    a = (j * count + i).ravel()
    b, c, d = a + 1, a + count + 1, a + count
    even = ((i + j) % 2 == 0).ravel()[:, None, None]
    one = np.stack([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)], axis=1)
    other = np.stack([np.stack([a, b, d], axis=1), np.stack([b, c, d], axis=1)], axis=1)
    return np.where(even, one, other).reshape(-1, 3)


def _side_triangles(count: int, lower: int) -> Integers:
    """Triangles between the rims of the upper face and of the lower one (``lower`` later)."""
    last = count - 1
    run = np.arange(count)
    rim = np.concatenate(
        [run[:-1], last + run[:-1] * count, (count * last + run)[:0:-1], (run * count)[:0:-1]]
    )  # counter-clockwise seen from above
    following = np.roll(rim, -1)
    first = np.stack([rim, rim + lower, following + lower], axis=1)
    second = np.stack([rim, following + lower, following], axis=1)
    return np.concatenate([first, second])
