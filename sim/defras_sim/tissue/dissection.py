"""Nested dissection: an order of elimination that keeps a sparse factor small.

A set of nodes is cut in two by removing a plane of nodes, the separator, and each half again, down
to a few nodes. Separators are eliminated after the halves they part, so that the halves never meet
(George, SIAM J. Numer. Anal. 10 (1973), 345-363). Planes are looked for along the axes; for a slab
and most organs that is as good as a partition of the graph, and needs no further library.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.tissue.matrices import jit
from defras_sim.tissue.mesh import Integers

# Nodes of a set that is not cut any more. Larger sets waste arithmetic, smaller ones calls.
LEAF_NODES = 24
# Shares of the nodes below the planes that are tried.
_SHARES: Floats = np.linspace(0.32, 0.68, 13)


@dataclass(frozen=True)
class Separator:
    """Nodes that are eliminated together, after those of its ``children`` (places in the order)."""

    nodes: Integers
    children: tuple[int, ...]


def dissect(starts: Integers, neighbours: Integers, places_m: Floats) -> list[Separator]:
    """Order of elimination, every separator after its children; the last one is the root.

    ``neighbours[starts[i] : starts[i + 1]]`` are those of node i, itself included or not;
    ``places_m`` (nodes, 3) says only where to cut.
    """
    order: list[Separator] = []
    side = np.zeros(len(places_m), dtype=np.int8)

    def cut(nodes: Integers) -> int:
        children: tuple[int, ...] = ()
        if len(nodes) > LEAF_NODES:
            kind = _cut(starts, neighbours, places_m, nodes, side, _SHARES)
            below, above = nodes[kind == 1], nodes[kind == 2]
            if len(below) and len(above):
                children = (cut(below), cut(above))
                nodes = nodes[kind == 0]
        order.append(Separator(nodes, children))
        return len(order) - 1

    cut(np.arange(len(places_m)))
    return order


@jit
def _cut(
    starts: Integers,
    neighbours: Integers,
    places: Floats,
    nodes: Integers,
    side: np.ndarray,
    shares: Floats,
) -> np.ndarray:
    """For each of ``nodes``: 0 in the separator, 1 below, 2 above.

    ``side`` (all nodes,) is zero before and after.
    """
    count = len(nodes)
    kind = np.zeros(count, dtype=np.int8)
    cheapest = np.inf
    for axis in range(3):
        along = np.empty(count)
        for i in range(count):
            along[i] = places[nodes[i], axis]
        ordered = np.sort(along)
        last = np.nan
        for share in shares:
            plane = ordered[int(share * (count - 1))] + 1e-9
            if abs(plane - last) <= 1e-9 or plane >= ordered[-1]:
                continue
            last = plane
            below = 0
            for i in range(count):
                side[nodes[i]] = 1 if along[i] <= plane else 2
                below += along[i] <= plane
            # The nodes on either side that touch the other one separate; take the fewer.
            touching = np.zeros(3, dtype=np.int64)
            for i in range(count):
                touching[side[nodes[i]]] += _touches(starts, neighbours, nodes[i], side)
            for taken in (1, 2):
                halves = below - (count - below) + (2 * taken - 3) * touching[taken]
                cost = touching[taken] * (1 + 2 * abs(halves) / count)
                if cost < cheapest:
                    cheapest = cost
                    for i in range(count):
                        mine = side[nodes[i]]
                        out = mine == taken and _touches(starts, neighbours, nodes[i], side)
                        kind[i] = 0 if out else mine
    for i in range(count):
        side[nodes[i]] = 0
    return kind


@jit
def _touches(starts: Integers, neighbours: Integers, node: int, side: np.ndarray) -> bool:
    """Whether a neighbour of ``node`` lies on the other side."""
    other = 3 - side[node]
    # Compiled code knows no any() of a generator.
    for k in range(starts[node], starts[node + 1]):  # noqa: SIM110
        if side[neighbours[k]] == other:
            return True
    return False
