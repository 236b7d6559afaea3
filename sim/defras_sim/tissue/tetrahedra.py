"""Shape functions and quadrature of tetrahedra, on the unit simplex.

``tetrahedron4``: linear, corners at the origin and at 1 on each axis. ``tetrahedron10``: quadratic,
nodes in VTK order (4 corners, then the middles of the edges in :data:`EDGES`).
Source: Zienkiewicz and Taylor, The Finite Element Method, vol. 1, ch. 4 (shape functions); Hammer
and Stroud, Math. Tables Aids Comput. 10 (1956), 137-139 (4-point rule of degree 2).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Floats

EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
"""Corners of each edge, in the order in which its middle follows the corners."""

FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
"""Corners of each face, counter-clockwise seen from outside."""

_FIRST, _SECOND = (list(ends) for ends in zip(*EDGES, strict=True))

# Gradients of the barycentric coordinates by the reference coordinates.
_SLOPES: Floats = np.array([[-1, -1, -1], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)

TETRAHEDRON10_NODES: Floats = np.concatenate(
    [np.vstack([np.zeros((1, 3)), np.eye(3)]), np.zeros((6, 3))]
)
TETRAHEDRON10_NODES[4:] = (TETRAHEDRON10_NODES[_FIRST] + TETRAHEDRON10_NODES[_SECOND]) / 2


def barycentric(points: Floats) -> Floats:
    """Barycentric coordinates (n, 4) of reference points (n, 3): the linear shape functions."""
    return np.column_stack([1 - points.sum(axis=1), points])


def linear_gradients(points: Floats) -> Floats:
    """Derivatives (n, 4, 3) of the linear shape functions."""
    return np.tile(_SLOPES, (len(points), 1, 1))


def quadratic_values(points: Floats) -> Floats:
    """Shape functions (n, 10) of the quadratic element at reference points (n, 3)."""
    share = barycentric(points)
    return np.concatenate(
        [share * (2 * share - 1), 4 * share[:, _FIRST] * share[:, _SECOND]], axis=1
    )


def quadratic_gradients(points: Floats) -> Floats:
    """Their derivatives (n, 10, 3)."""
    share = barycentric(points)[:, :, None]
    corners = (4 * share - 1) * _SLOPES
    edges = share[:, _FIRST] * _SLOPES[_SECOND] + share[:, _SECOND] * _SLOPES[_FIRST]
    return np.concatenate([corners, 4 * edges], axis=1)


def four_points() -> tuple[Floats, Floats]:
    """Points (4, 3) and weights (4,) of the rule of degree 2.

    It sees all 24 ways in which ten nodes can strain an element, and no more points are needed for
    the stiffness of an element with straight edges.
    """
    near, far = (5 - np.sqrt(5)) / 20, (5 + 3 * np.sqrt(5)) / 20
    points = np.full((4, 3), near)
    points[[1, 2, 3], [0, 1, 2]] = far
    return points, np.full(4, 1 / 24)


def with_edge_middles(
    nodes_m: Floats, corners: NDArray[np.int64]
) -> tuple[Floats, NDArray[np.int64]]:
    """Nodes and quadratic tetrahedra (m, 10) with straight edges, from linear ones (m, 4)."""
    ends = np.sort(corners[:, EDGES], axis=2).reshape(-1, 2)
    edges, number = np.unique(ends, axis=0, return_inverse=True)
    middles = nodes_m[edges].mean(axis=1)
    connectivity = np.column_stack([corners, len(nodes_m) + number.reshape(-1, len(EDGES))])
    return np.concatenate([nodes_m, middles]), connectivity
