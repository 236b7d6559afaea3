"""Blocks of node pairs stand where a dense matrix has them."""

import numpy as np

from defras_sim.tissue.layout import TangentLayout, add_blocks, add_scalars

NODES = 7


def random_pairs(seed: int, count: int) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, NODES, (count, 2))


def test_blocks_add_up_as_in_a_dense_matrix():
    first, second = random_pairs(0, 20), random_pairs(1, 9)  # overlapping, with repetitions
    layout = TangentLayout.of(NODES, [first, second])
    blocks = np.random.default_rng(2).normal(size=(len(first), 3, 3))
    scalars = np.random.default_rng(3).normal(size=len(second))
    entries = np.zeros(layout.pattern.nnz)
    add_blocks(blocks, layout.places(first), entries)
    add_scalars(scalars, layout.places(second), entries)
    expected = np.zeros((3 * NODES, 3 * NODES))
    for (row, column), block in zip(first, blocks, strict=True):
        expected[3 * row : 3 * row + 3, 3 * column : 3 * column + 3] += block
    for (row, column), scalar in zip(second, scalars, strict=True):
        expected[3 * row : 3 * row + 3, 3 * column : 3 * column + 3] += scalar * np.eye(3)
    np.testing.assert_allclose(layout.matrix(entries).toarray(), expected, atol=1e-15)


def test_the_pattern_is_canonical_and_no_larger_than_needed():
    pairs = random_pairs(4, 15)
    layout = TangentLayout.of(NODES, [pairs])
    pattern = layout.pattern
    assert pattern.nnz == 9 * len(np.unique(pairs, axis=0))
    assert np.all(pattern.data == 0)
    for column in range(pattern.shape[1]):
        rows = pattern.indices[pattern.indptr[column] : pattern.indptr[column + 1]]
        assert np.all(np.diff(rows) > 0)


def test_nothing_coupled_is_an_empty_matrix():
    assert TangentLayout.of(NODES, []).pattern.nnz == 0
