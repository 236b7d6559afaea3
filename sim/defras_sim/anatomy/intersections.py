"""Finds triangles of one surface that cut each other."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from rtree.index import Index, Property

from defras_sim.geometry import Floats

Integers = NDArray[np.int64]

_EDGES = np.array([[0, 1], [1, 2], [2, 0]])
_QUERIES = 4096
# In barycentric coordinates and along an edge. Triangles that touch within this cut each other.
_ROUNDING = 1e-9


def first_intersection(vertices_m: Floats, triangles: Integers) -> Floats | None:
    """A point (3,) at which two of ``triangles`` (m, 3) cut each other; None if none do.

    Of triangles with a common corner, only the sides away from it are looked at; those with a
    common edge cannot cut each other unless they lie upon one another.
    """
    corners = vertices_m[triangles]
    for one, other in _near_pairs(corners):
        common = (triangles[one][:, :, None] == triangles[other][:, None, :]).any(axis=2)
        away = (triangles[other][:, :, None] == triangles[one][:, None, :]).any(axis=2)
        for mine, theirs, shared in ((one, other, common), (other, one, away)):
            found = _cut(corners[mine], corners[theirs], shared)
            if found is not None:
                return found
    return None


def _near_pairs(corners: Floats) -> Iterator[tuple[Integers, Integers]]:
    """Pairs (k,), (k,) of triangles whose boxes meet and that have at most one common corner."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    boxes = np.concatenate([low, high], axis=1)
    index = Index(
        ((i, box, None) for i, box in enumerate(boxes.tolist())), properties=Property(dimension=3)
    )
    for start in range(0, len(corners), _QUERIES):
        part = slice(start, start + _QUERIES)
        found, counts = index.intersection_v(low[part], high[part])
        one = np.repeat(np.arange(start, start + len(counts)), counts.astype(np.int64))
        other = found.astype(np.int64)
        later = other > one
        yield one[later], other[later]


def _cut(corners: Floats, through: Floats, shared: NDArray[np.bool_]) -> Floats | None:
    """Where a side of one triangle (k, 3, 3) passes through the other (k, 3, 3), if any does.

    ``shared`` (k, 3) marks corners that belong to both: their sides are left out.
    """
    usable = ~shared[:, _EDGES].any(axis=2) & (shared.sum(axis=1) < 2)[:, None]
    pair, side = np.nonzero(usable)
    start = corners[pair, _EDGES[side, 0]]
    way = corners[pair, _EDGES[side, 1]] - start
    origin = through[pair, 0]
    first, second = through[pair, 1] - origin, through[pair, 2] - origin
    # Moeller and Trumbore, J. Graphics Tools 2 (1997), 21-28.
    across = np.cross(way, second)
    determinant = np.sum(first * across, axis=1)
    # Not the length of ``across``: of parallel sides that is itself nothing but rounding.
    lengths = np.linalg.norm(np.stack([first, second, way]), axis=2)
    crossing = np.abs(determinant) > _ROUNDING * lengths.prod(axis=0)
    inverse = np.divide(1.0, determinant, out=np.zeros_like(determinant), where=crossing)
    from_origin = start - origin
    u = inverse * np.sum(from_origin * across, axis=1)
    around = np.cross(from_origin, first)
    v = inverse * np.sum(way * around, axis=1)
    along = inverse * np.sum(second * around, axis=1)
    inside = (np.minimum(u, v) >= -_ROUNDING) & (u + v <= 1 + _ROUNDING)
    inside &= (along >= -_ROUNDING) & (along <= 1 + _ROUNDING) & crossing
    hit = np.flatnonzero(inside)
    return None if not len(hit) else np.asarray(start[hit[0]] + along[hit[0]] * way[hit[0]])
