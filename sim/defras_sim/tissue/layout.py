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
        keys = np.unique(both[:, 1] * nodes + both[:, 0])
        columns, rows = np.divmod(keys, nodes)
        starts = np.searchsorted(columns, np.arange(nodes + 1))
        graph = sparse.csc_array((np.ones(len(keys)), rows, starts), shape=(nodes, nodes))
        return TangentLayout(graph)

    @cached_property
    def pattern(self) -> sparse.csc_array:
        """The matrix (3 nodes, 3 nodes) with all its entries zero."""
        pattern = sparse.csc_array(sparse.kron(self.graph, np.ones((3, 3)), format="csc"))
        pattern.sort_indices()
        pattern.data[:] = 0.0
        return pattern

    @cached_property
    def _keys(self) -> Integers:
        nodes = np.int64(self.graph.shape[0])
        return np.repeat(np.arange(nodes), np.diff(self.graph.indptr)) * nodes + self.graph.indices

    def places(self, pairs: Integers) -> Places:
        """Where the blocks of ``pairs`` (m, 2), which the layout holds, stand."""
        rows, columns = pairs[:, 0], pairs[:, 1]
        start = self.graph.indptr[columns].astype(np.int64)
        height = np.diff(self.graph.indptr)[columns].astype(np.int64)
        within = np.searchsorted(self._keys, columns * self.graph.shape[0] + rows) - start
        first = 9 * start + 3 * within
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
