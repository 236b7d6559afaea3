"""A face of the tissue given by triangles: a height over x and y, with a rim."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from defras_sim.anatomy.bins import Bins
from defras_sim.geometry import Floats

Triangles = NDArray[np.int64]

# Barycentric coordinates this far below 0 still count as inside: neighbours leave no gaps.
_ROUNDING = 1e-9
# A place outside is moved this far within the rim.
_INSIDE_M = 1e-6


@dataclass(frozen=True, eq=False)
class CurvedFace:
    """``vertices_m`` (n, 3); ``triangles`` (m, 3), none of them vertical.

    Where several lie over one another, the highest counts if ``sign`` is 1, the lowest if -1.
    """

    vertices_m: Floats
    triangles: Triangles
    sign: int

    def at(self, xy_m: Floats) -> Floats:
        """See :meth:`defras_sim.rest_shape.Face.at`."""
        places = np.asarray(xy_m, dtype=float)
        flat = self._squeezed(places.reshape(-1, 2))
        triangle, share = self._find(flat)
        points = np.einsum("nk,nkd->nd", share, self.vertices_m[self.triangles[triangle]])
        return np.asarray(points).reshape(*places.shape[:-1], 3)

    def tangents(self, xy_m: Floats) -> Floats:
        """See :meth:`defras_sim.rest_shape.Face.tangents`. Normals are smoothed over triangles."""
        places = np.asarray(xy_m, dtype=float)
        triangle, share = self._find(self._squeezed(places.reshape(-1, 2)))
        normal = np.einsum("nk,nkd->nd", share, self._normals[self.triangles[triangle]])
        first = np.column_stack([normal[:, 2], np.zeros(len(normal)), -normal[:, 0]])
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        second = np.cross(normal, first)
        second /= np.linalg.norm(second, axis=1, keepdims=True)
        return np.stack([first, second], axis=1).reshape(*places.shape[:-1], 2, 3)

    def inset(self, xy_m: Floats, margin_m: float) -> Floats:
        """See :meth:`defras_sim.rest_shape.Face.inset`."""
        place = self._squeezed(np.asarray(xy_m, dtype=float)[None])[0]
        if self.rim_distance_m(place[None])[0] >= margin_m:
            return place
        # Candidates on finer and finer circles around the place; the nearest with room wins, and
        # where none has, the one with most room.
        turn = np.arange(48) * (2 * np.pi / 48)
        ways = np.concatenate([[0.0], np.linspace(0.1, 2.0, 20) * margin_m])
        around = place + ways[:, None, None] * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        around = around.reshape(-1, 2)
        around = around[self.covers(around)]
        room = self.rim_distance_m(around)
        enough = np.flatnonzero(room >= margin_m)
        if not len(enough):
            return np.asarray(around[int(np.argmax(room))])
        way = np.linalg.norm(around[enough] - place, axis=1)
        return np.asarray(around[enough[int(np.argmin(way))]])

    def covers(self, xy_m: Floats) -> NDArray[np.bool_]:
        """Over which of ``xy_m`` (n, 2) the face extends."""
        return self._find(np.asarray(xy_m, dtype=float))[0] >= 0

    def rim_distance_m(self, xy_m: Floats) -> Floats:
        """Distance (n,) in x and y from ``xy_m`` (n, 2) to the face's rim."""
        return np.linalg.norm(self._nearest_on_rim(xy_m)[0] - xy_m, axis=1)

    @cached_property
    def _normals(self) -> Floats:
        """Unit normals (n, 3) of the vertices, upwards: the area-weighted mean."""
        a, b, c = np.moveaxis(self.vertices_m[self.triangles], 1, 0)
        face = np.cross(b - a, c - a)
        face *= np.sign(face[:, 2:])
        total = np.zeros_like(self.vertices_m)
        for k in range(3):
            np.add.at(total, self.triangles[:, k], face)
        length = np.linalg.norm(total, axis=1, keepdims=True)
        return np.divide(total, length, out=np.zeros_like(total), where=length > 0)

    @cached_property
    def _rim(self) -> tuple[Floats, Floats]:
        """Starts and ends (k, 2) of the edges that belong to one triangle only."""
        edges = np.sort(self.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        unique, count = np.unique(edges, axis=0, return_counts=True)
        ends = self.vertices_m[unique[count == 1]][..., :2]
        return ends[:, 0], ends[:, 1]

    @cached_property
    def _bins(self) -> Bins:
        corners = self.vertices_m[self.triangles][..., :2]
        return Bins(corners.min(axis=1), corners.max(axis=1))

    @cached_property
    def _charts(self) -> tuple[Floats, Floats]:
        """First corners (m, 2), and matrices (m, 2, 2) from there to barycentric coordinates."""
        corners = self.vertices_m[self.triangles][..., :2]
        sides = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=-1)
        return corners[:, 0], np.asarray(np.linalg.inv(sides), dtype=float)

    def _find(self, xy_m: Floats) -> tuple[NDArray[np.int64], Floats]:
        """Triangle (n,), -1 for none, and barycentric coordinates (n, 3) of each place (n, 2)."""
        triangle = np.full(len(xy_m), -1)
        share = np.zeros((len(xy_m), 3))
        point, candidate = self._bins.candidates(xy_m)
        if not len(point):
            return triangle, share
        first, to_share = self._charts
        two = np.einsum("kij,kj->ki", to_share[candidate], xy_m[point] - first[candidate])
        three = np.concatenate([1 - two.sum(axis=1, keepdims=True), two], axis=1)
        height = self.sign * self.vertices_m[self.triangles[candidate], 2]
        found = np.flatnonzero(three.min(axis=1) >= -_ROUNDING)
        # By point, then from the outermost inwards: the first of each point counts.
        outermost = np.sum(three[found] * height[found], axis=1)
        found = found[np.lexsort((-outermost, point[found]))]
        places, best = np.unique(point[found], return_index=True)
        triangle[places] = candidate[found[best]]
        share[places] = three[found[best]]
        return triangle, share

    def _squeezed(self, xy_m: Floats) -> Floats:
        """The same places (n, 2), those outside moved to just within the rim."""
        outside = self._find(xy_m)[0] < 0
        if not outside.any():
            return xy_m
        moved = xy_m.copy()
        nearest, centre = self._nearest_on_rim(xy_m[outside])
        inwards = centre - nearest
        inwards /= np.linalg.norm(inwards, axis=1, keepdims=True)
        moved[outside] = nearest + _INSIDE_M * inwards
        return moved

    def _nearest_on_rim(self, xy_m: Floats) -> tuple[Floats, Floats]:
        """Nearest points (n, 2) of the rim, and centres (n, 2) of the triangles they belong to."""
        starts, ends = self._rim
        along = ends - starts
        share = np.einsum("nkd,kd->nk", xy_m[:, None] - starts, along) / np.sum(along**2, axis=1)
        points = starts + np.clip(share, 0.0, 1.0)[..., None] * along
        best = np.argmin(np.linalg.norm(points - xy_m[:, None], axis=-1), axis=1)
        return points[np.arange(len(best)), best], self._rim_centres[best]

    @cached_property
    def _rim_centres(self) -> Floats:
        """Centre (k, 2) of the triangle at each edge of the rim."""
        edges = np.sort(self.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        _, first, count = np.unique(edges, axis=0, return_index=True, return_counts=True)
        triangle = first[count == 1] // 3
        return np.asarray(self.vertices_m[self.triangles[triangle]][..., :2].mean(axis=1))
