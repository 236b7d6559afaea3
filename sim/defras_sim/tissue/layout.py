"""Where second derivatives of the potential energy stand in one sparse matrix, laid out once."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from defras_sim.geometry import Floats
from defras_sim.tissue.matrices import jit
from defras_sim.tissue.mesh import Integers

Places = NDArray[np.int32]
"""(pairs, 3): where the three columns of each pair's 3x3 block start among a matrix's entries; the
three rows of a column follow one another."""


@dataclass(frozen=True)
class TangentLayout:
    """Sparsity of a symmetric matrix (3 nodes, 3 nodes) made of 3x3 blocks of coupled nodes.

    ``graph`` (nodes, nodes), CSC with sorted indices, has an entry for each coupled pair.
    """

    graph: sparse.csc_array

    @staticmethod
    def of(nodes: int, pairs: Iterable[Integers]) -> TangentLayout:
        """The smallest that holds all ``pairs``: each (m, 2) of row node and column node."""
        both = np.concatenate([np.zeros((0, 2), dtype=np.int64), *pairs])
        entries = (np.ones(len(both)), (both[:, 0], both[:, 1]))
        graph = sparse.csc_array(entries, shape=(nodes, nodes))
        graph.sum_duplicates()  # and sorts
        return TangentLayout(graph)

    @cached_property
    def pattern(self) -> sparse.csc_array:
        """The matrix (3 nodes, 3 nodes) with all its entries zero."""
        graph, size = self.graph, 3 * self.graph.shape[0]
        starts = self._starts(np.arange(graph.nnz), self._columns)[:, :, None] + np.arange(3)
        rows = 3 * graph.indices[:, None, None] + np.arange(3)
        indices = np.empty(starts.size, dtype=np.int32)
        indices[starts] = rows
        heights = np.repeat(3 * np.diff(graph.indptr), 3)
        indptr = np.concatenate([[0], np.cumsum(heights)]).astype(np.int32)
        pattern = sparse.csc_array((np.zeros(starts.size), indices, indptr), shape=(size, size))
        pattern.has_sorted_indices = True
        return pattern

    @cached_property
    def _columns(self) -> Integers:
        """Column node (m,) of each entry of the graph."""
        nodes = self.graph.shape[0]
        return np.repeat(np.arange(nodes, dtype=np.int64), np.diff(self.graph.indptr))

    def places(self, pairs: Integers) -> Places:
        """Where the blocks of ``pairs`` (m, 2), which the layout holds, stand."""
        nodes = self.graph.shape[0]
        keys = self._columns * nodes + self.graph.indices
        entries = np.searchsorted(keys, pairs[:, 1] * nodes + pairs[:, 0])
        return self._starts(entries, pairs[:, 1])

    def _starts(self, entries: Integers, columns: Integers) -> Places:
        """Places of the graph's ``entries`` (m,), which stand in ``columns`` (m,)."""
        before = self.graph.indptr[columns].astype(np.int64)
        height = np.diff(self.graph.indptr)[columns].astype(np.int64)
        first = 9 * before + 3 * (entries - before)
        return (first[:, None] + 3 * height[:, None] * np.arange(3)).astype(np.int32)

    def matrix(self, entries: Floats) -> sparse.csc_array:
        """The matrix with ``entries`` (as many as the pattern has), which it keeps."""
        pattern = self.pattern
        return sparse.csc_array((entries, pattern.indices, pattern.indptr), shape=pattern.shape)


@jit
def add_blocks(blocks: Floats, places: Places, entries: Floats) -> None:
    """Add ``blocks`` (pairs, 3, 3) to a matrix's ``entries``."""
    for pair in range(len(blocks)):
        for k in range(3):
            for i in range(3):
                entries[places[pair, k] + i] += blocks[pair, i, k]


@jit
def add_scalars(scalars: Floats, places: Places, entries: Floats) -> None:
    """Add ``scalars`` (pairs,) times the unit matrix to a matrix's ``entries``."""
    for pair in range(len(scalars)):
        for i in range(3):
            entries[places[pair, i] + i] += scalars[pair]
