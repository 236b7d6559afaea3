"""The faces that bound a mesh, and points on them by which pressures are integrated."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.scene import ElementName
from defras_sim.tissue import tetrahedra
from defras_sim.tissue.elements import shape_gradients, shape_values
from defras_sim.tissue.mesh import Integers, Mesh


@dataclass(frozen=True)
class Boundary:
    """Faces (f, w) by their nodes, with shape functions ``values`` (f, points, w) on each.

    ``areas_m2`` (f, points) are the points' shares of the area at rest.
    """

    faces: Integers
    values: Floats
    areas_m2: Floats

    def pairs(self) -> Integers:
        """Every pair of nodes of every face (f x w x w, 2)."""
        width = self.faces.shape[1]
        rows = np.repeat(self.faces, width, axis=1).ravel()
        return np.column_stack([rows, np.tile(self.faces, (1, width)).ravel()])


@dataclass(frozen=True)
class _Face:
    """A face of the reference element: points (q, 3), weights (q,), two edges (2, 3)."""

    points: Floats
    weights: Floats
    edges: Floats


def boundary_of(mesh: Mesh) -> Boundary:
    """All faces of ``mesh`` that belong to one element only.

    The points are the nodes and the faces' centres, all with positive weights: what keeps them off
    an obstacle keeps the whole face off it. Simpson's rule on quadrilaterals; on triangles those of
    Zienkiewicz and Taylor, The Finite Element Method, vol. 1, ch. 5.
    """
    faces, values, areas = [], [], []
    for face in _reference_faces(mesh.element):
        shapes = shape_values(mesh.element, face.points)
        on_face = np.flatnonzero(np.abs(shapes).max(axis=0) > 1e-12)
        slopes = shape_gradients(mesh.element, face.points)
        slopes_along = np.einsum("qaj,kj->qka", slopes, face.edges)
        along = np.einsum("eai,qka->eqki", mesh.nodes_m[mesh.connectivity], slopes_along)
        area = np.linalg.norm(np.cross(along[:, :, 0], along[:, :, 1]), axis=-1)
        faces.append(mesh.connectivity[:, on_face])
        values.append(np.broadcast_to(shapes[:, on_face], (len(area), *shapes[:, on_face].shape)))
        areas.append(area * face.weights)
    every = np.concatenate(faces)
    _, first, count = np.unique(
        np.sort(every, axis=1), axis=0, return_index=True, return_counts=True
    )
    outside = np.sort(first[count == 1])
    return Boundary(
        every[outside],
        np.ascontiguousarray(np.concatenate(values)[outside]),
        np.concatenate(areas)[outside],
    )


def _reference_faces(element: ElementName) -> Iterator[_Face]:
    if element == "hexahedron20":
        x, w = _lobatto()
        first, second = (grid.ravel() for grid in np.meshgrid(x, x, indexing="ij"))
        for axis in range(3):
            for side in (-1.0, 1.0):
                points = np.insert(np.column_stack([first, second]), axis, side, axis=1)
                yield _Face(points, np.outer(w, w).ravel(), np.delete(np.eye(3), axis, axis=0))
        return
    shares, weights = _triangle_rule(element)
    for corners in tetrahedra.FACES:
        at = tetrahedra.TETRAHEDRON10_NODES[list(corners)]
        yield _Face(shares @ at, weights, at[1:] - at[0])


def _lobatto() -> tuple[Floats, Floats]:
    """Five points on [-1, 1], ends and middle among them, and their weights: exact to degree 7."""
    inner = np.sqrt(3 / 7)
    return np.array([-1.0, -inner, 0.0, inner, 1.0]), np.array([9.0, 49.0, 64.0, 49.0, 9.0]) / 90


def _triangle_rule(element: ElementName) -> tuple[Floats, Floats]:
    """Barycentric points (q, 3) and weights that add up to 1/2."""
    corners, centre = np.eye(3), np.full((1, 3), 1 / 3)
    if element == "tetrahedron4":
        return np.vstack([corners, centre]), np.array([1, 1, 1, 9]) / 24
    middles = (np.ones((3, 3)) - corners) / 2
    weights = np.array([3, 3, 3, 8, 8, 8, 27]) / 120
    return np.vstack([corners, middles, centre]), weights
