"""Meshes of ten-node tetrahedra of any shape."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from defras_sim.anatomy.anatomy import VolumeMesh
from defras_sim.geometry import Floats
from defras_sim.tissue.elements import Quadrature
from defras_sim.tissue.mesh import Integers, Mesh
from defras_sim.tissue.tetrahedra import four_points, with_edge_middles

# Points compared with elements at once: keeps the arrays below some ten megabytes.
_CHUNK = 2**17
# Barycentric coordinates may fall this far below 0. Two meshes of one surface differ by fractions
# of a millimetre, so that a point of the surface may lie a little outside; its element is straight
# and is simply continued.
_OUTSIDE = 0.3


@dataclass(frozen=True)
class TetrahedralMesh(Mesh):
    """Tetrahedra with straight edges.

    Curved ones would follow the surface more closely (10 mm edges on a sphere of 60 mm leave
    0.2 mm), but may be inverted where the mesher's are not, and where a rest point lies in one is
    an equation to be solved instead of a product.
    """

    @property
    def quadrature(self) -> Quadrature:
        return Quadrature(*four_points())

    def locate(self, points_m: Floats) -> tuple[Integers, Floats]:
        """See :meth:`Mesh.locate`: the element whose smallest barycentric coordinate is largest."""
        elements = np.empty(len(points_m), dtype=np.int64)
        local = np.empty((len(points_m), 3))
        first, to_local = self._charts
        step = max(1, _CHUNK // len(first))
        for start in range(0, len(points_m), step):
            part = slice(start, start + step)
            found = np.einsum("eij,nej->nei", to_local, points_m[part, None] - first)
            least = np.minimum(found.min(axis=-1), 1 - found.sum(axis=-1))
            best = np.argmax(least, axis=1)
            rows = np.arange(len(best))
            elements[part], local[part] = best, found[rows, best]
            if np.any(least[rows, best] < -_OUTSIDE):
                worst = points_m[start + int(np.argmin(least[rows, best]))]
                raise ValueError(f"point {np.round(worst, 4)} m lies outside the tissue")
        return elements, local

    @cached_property
    def _charts(self) -> tuple[Floats, Floats]:
        """First corners (e, 3), and matrices (e, 3, 3) from there to reference coordinates."""
        corners = self.nodes_m[self.connectivity[:, :4]]
        sides = np.moveaxis(corners[:, 1:] - corners[:, :1], 1, 2)
        return corners[:, 0], np.asarray(np.linalg.inv(sides), dtype=float)


def tetrahedral_mesh(volume: VolumeMesh) -> TetrahedralMesh:
    """Ten-node tetrahedra on ``volume``."""
    nodes_m, connectivity = with_edge_middles(volume.nodes_m, volume.tetrahedra)
    return TetrahedralMesh("tetrahedron10", nodes_m, connectivity)
