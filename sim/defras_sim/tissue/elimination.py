"""What the sparsity of a matrix says about its factorisation, before any number is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from defras_sim.geometry import Floats
from defras_sim.tissue.dissection import Separator, dissect
from defras_sim.tissue.matrices import jit
from defras_sim.tissue.mesh import Integers


@dataclass(frozen=True)
class Plan:
    """A multifrontal elimination. Fronts stand in the order in which they are eliminated.

    ``graph`` (nodes, nodes) says which nodes interact; ``unknowns`` are the matrix' rows in the
    order of elimination. Of each front: ``sizes`` and ``borders`` (unknowns eliminated, and met),
    ``first_unknowns``, its two ``children`` or -1, and where its panel, its update and its border
    start (with one more at the end). ``border_nodes`` are places in the order, ``local`` where
    these nodes stand in the parent's front. ``entry_places`` and ``entry_sources`` bring entries of
    the matrix into the panels. ``halves``: the fronts before the first of these, and from there to
    the second, know nothing of each other; None if one front is all.
    """

    graph: sparse.csc_array
    unknowns: Integers
    sizes: Integers
    borders: Integers
    first_unknowns: Integers
    children: Integers
    panel_starts: Integers
    update_starts: Integers
    border_starts: Integers
    border_nodes: Integers
    local: Integers
    entry_starts: Integers
    entry_places: Integers
    entry_sources: Integers
    halves: tuple[int, int] | None


def plan(matrix: sparse.csc_array, places_m: Floats) -> Plan:
    """The elimination of symmetric matrices with the sparsity of ``matrix``.

    Its unknowns are x, y, z of each node in turn; ``places_m`` (nodes, 3).
    """
    graph = _interactions(matrix)
    columns, rows = graph.indptr.astype(np.int64), graph.indices.astype(np.int64)
    tree = dissect(columns, rows, places_m)
    order = np.concatenate([separator.nodes for separator in tree])
    counts = np.array([len(separator.nodes) for separator in tree])
    firsts = _starts(counts)
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    borders = _borders(tree, firsts, columns, place[rows])
    met = np.array([len(border) for border in borders])
    border_nodes, border_starts = np.concatenate(borders), _starts(met)
    children = np.full((len(tree), 2), -1, dtype=np.int64)
    parents = np.full(len(tree), len(tree) - 1)
    for number, separator in enumerate(tree):
        children[number, : len(separator.children)] = separator.children
        parents[list(separator.children)] = number
    panel_starts = _starts(9 * counts * (counts + met))
    owners = np.repeat(np.arange(len(tree)), counts)
    entries = _entries(
        matrix.indptr, matrix.indices, place, owners, firsts, border_starts, border_nodes,
        panel_starts,
    )  # fmt: skip
    last = tree[-1].children
    return Plan(
        graph=graph,
        unknowns=(3 * order[:, None] + np.arange(3)).ravel(),
        sizes=3 * counts,
        borders=3 * met,
        first_unknowns=3 * firsts[:-1],
        children=children,
        panel_starts=panel_starts,
        update_starts=_starts(9 * met**2),
        border_starts=border_starts,
        border_nodes=border_nodes,
        local=_local_in_parents(parents, firsts, border_starts, border_nodes),
        entry_starts=entries[0],
        entry_places=entries[1],
        entry_sources=entries[2],
        halves=(last[0] + 1, last[1] + 1) if last else None,
    )


def _interactions(matrix: sparse.csc_array) -> sparse.csc_array:
    """Which nodes interact (nodes, nodes)."""
    nodes = matrix.shape[0] // 3
    ones = np.ones(matrix.nnz, dtype=np.int8)
    columns = matrix.indptr[::3].copy()
    graph = sparse.csc_array((ones, matrix.indices // 3, columns), shape=(nodes, nodes))
    graph.sum_duplicates()
    return graph


def _borders(
    tree: list[Separator], firsts: Integers, columns: Integers, neighbours: Integers
) -> list[Integers]:
    """Places of the nodes that the elimination of each separator meets, in order."""
    borders: list[Integers] = []
    for number, separator in enumerate(tree):
        near = [neighbours[columns[node] : columns[node + 1]] for node in separator.nodes]
        met = np.unique(np.concatenate([*near, *(borders[child] for child in separator.children)]))
        borders.append(met[met >= firsts[number + 1]])
    return borders


@jit
def _local(
    front: int, place: int, firsts: Integers, border_starts: Integers, border_nodes: Integers
) -> int:
    """Where the node at ``place`` in the order stands in ``front``."""
    if place < firsts[front + 1]:
        return place - firsts[front]
    border = border_nodes[border_starts[front] : border_starts[front + 1]]
    return firsts[front + 1] - firsts[front] + np.searchsorted(border, place)


@jit
def _local_in_parents(
    parents: Integers, firsts: Integers, border_starts: Integers, border_nodes: Integers
) -> Integers:
    local = np.empty(len(border_nodes), dtype=np.int64)
    for front in range(len(parents)):
        for k in range(border_starts[front], border_starts[front + 1]):
            local[k] = _local(parents[front], border_nodes[k], firsts, border_starts, border_nodes)
    return local


@jit
def _entries(
    indptr: Integers,
    indices: Integers,
    place: Integers,
    owners: Integers,
    firsts: Integers,
    border_starts: Integers,
    border_nodes: Integers,
    panel_starts: Integers,
) -> tuple[Integers, Integers, Integers]:
    """Entries of the upper triangle in the new order, by front.

    Where those of each front start, their places in the panels, their sources in the matrix.
    """
    fronts = len(firsts) - 1
    starts = np.zeros(fronts + 1, dtype=np.int64)
    for column in range(len(indptr) - 1):
        after = 3 * place[column // 3] + column % 3
        for k in range(indptr[column], indptr[column + 1]):
            row = indices[k]
            if 3 * place[row // 3] + row % 3 <= after:
                starts[owners[place[row // 3]] + 1] += 1
    for front in range(fronts):
        starts[front + 1] += starts[front]
    filled = starts[:-1].copy()
    places = np.empty(starts[-1], dtype=np.int64)
    sources = np.empty(starts[-1], dtype=np.int64)
    for column in range(len(indptr) - 1):
        other = place[column // 3]
        for k in range(indptr[column], indptr[column + 1]):
            row = indices[k]
            mine = place[row // 3]
            if 3 * mine + row % 3 > 3 * other + column % 3:
                continue
            front = owners[mine]
            own = firsts[front + 1] - firsts[front]
            width = 3 * (own + border_starts[front + 1] - border_starts[front])
            down = 3 * (mine - firsts[front]) + row % 3
            local = _local(front, other, firsts, border_starts, border_nodes)
            places[filled[front]] = panel_starts[front] + down * width + 3 * local + column % 3
            sources[filled[front]] = k
            filled[front] += 1
    return starts, places, sources


def _starts(lengths: Integers) -> Integers:
    return np.concatenate([[0], np.cumsum(lengths)])
