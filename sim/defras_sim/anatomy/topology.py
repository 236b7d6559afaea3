"""What a surface is made of: bodies, rims, how its triangles hang together."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from defras_sim.geometry import Floats

Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Topology:
    """Of ``triangles`` (m, 3)."""

    triangles: Integers

    @cached_property
    def _edges(self) -> tuple[Integers, Integers, Integers]:
        """Unique edges (e, 2), each triangle's three (3 m,), and triangles an edge (e,)."""
        directed = self.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
        edges, number, count = np.unique(
            np.sort(directed, axis=1), axis=0, return_inverse=True, return_counts=True
        )
        return edges, number.ravel(), count

    @property
    def crowded_edges(self) -> Integers:
        """Edges (k, 2) of more than two triangles: there the surface is no surface."""
        edges, _, count = self._edges
        return edges[count > 2]

    def pinched_vertices(self) -> Integers:
        """Vertices (k,) at which parts of the surface touch that share no edge there."""
        _, number, count = self._edges
        order = np.argsort(number, kind="stable")
        corner = np.arange(3 * len(self.triangles))
        # A corner is joined to the corners of its vertex in the triangles across its two edges.
        start = np.concatenate([[0], np.cumsum(count)])[:-1][count == 2]
        one, other = order[start], order[start + 1]
        pairs = []
        for edge in (one, other):
            twin = other if edge is one else one
            for end in (0, 1):
                mine = edge // 3 * 3 + (edge % 3 + end) % 3
                vertex = self.triangles.ravel()[mine]
                across = twin // 3 * 3
                hit = self.triangles[twin // 3] == vertex[:, None]
                pairs.append(np.stack([mine, across + np.argmax(hit, axis=1)]))
        row, column = np.concatenate(pairs, axis=1)
        graph = sparse.coo_array((np.ones(len(row)), (row, column)), shape=(len(corner),) * 2)
        fan = connected_components(graph, directed=False)[1]
        vertices = self.triangles.ravel()
        fans = np.unique(np.stack([vertices, fan], axis=1), axis=0)[:, 0]
        found, times = np.unique(fans, return_counts=True)
        return np.asarray(found[times > 1])

    def bodies(self) -> Integers:
        """Number of the body (m,) that each triangle belongs to, the largest body first."""
        _, number, _ = self._edges
        triangle = np.repeat(np.arange(len(self.triangles)), 3)
        joined = sparse.coo_array(
            (np.ones(len(number)), (triangle, number)), shape=(len(self.triangles), len(number))
        ).tocsr()
        label = connected_components(joined @ joined.T, directed=False)[1]
        by_size = np.argsort(-np.bincount(label), kind="stable")
        return np.asarray(np.argsort(by_size)[label])

    def rims(self) -> list[Integers]:
        """Closed loops of vertices along edges of one triangle, as that triangle goes round.

        Raises:
            ValueError: two loops meet in one vertex.
        """
        _, number, count = self._edges
        directed = self.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
        open_edges = directed[count[number] == 1]
        follows = dict(open_edges.tolist())
        if len(follows) < len(open_edges):
            raise ValueError("two holes of the surface meet in one vertex")
        loops = []
        while follows:
            start, here = follows.popitem()
            loop = [start]
            while here != start:
                loop.append(here)
                here = follows.pop(here)
            loops.append(np.array(loop))
        return loops


def length_m(loop: Integers, vertices_m: Floats) -> float:
    """Length of a closed loop of vertices."""
    points = vertices_m[loop]
    return float(np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1).sum())
