"""The factorisation against numpy's dense solver and scipy's sparse one."""

import threading

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import spsolve

from defras_sim.scene import Tissue
from defras_sim.tissue.assembly import ElasticBody
from defras_sim.tissue.dissection import LEAF_NODES, dissect
from defras_sim.tissue.elimination import plan
from defras_sim.tissue.equilibrium import PotentialEnergy
from defras_sim.tissue.factorisation import NotPositiveDefinite, SparseCholesky
from defras_sim.tissue.materials import lame_parameters
from defras_sim.tissue.mesh import slab_mesh


def tied_slab(element="hexahedron20", cells=(5, 4, 2)):
    """The tangent of a slab at rest, with something on its diagonal that holds it; its nodes."""
    mesh = slab_mesh(Tissue(), element, cells)
    body = ElasticBody(mesh, "neo_hookean", *lame_parameters("neo_hookean", 3000.0, 0.45))
    free = PotentialEnergy(len(mesh.nodes_m), [body]).tangent(mesh.nodes_m)
    diagonal = np.random.default_rng(1).uniform(0.1, 5.0, free.shape[0])
    matrix = free.copy()
    matrix.setdiag(free.diagonal() + diagonal)
    return matrix, mesh.nodes_m


def scattered(seed, nodes=90, couplings=300):
    """A random positive definite matrix whose blocks have nothing to do with where nodes lie."""
    rng = np.random.default_rng(seed)
    rows, columns = rng.integers(0, nodes, (2, couplings))
    blocks = sparse.csr_array((np.ones(couplings), (rows, columns)), shape=(nodes, nodes))
    half = sparse.kron(blocks, np.ones((3, 3)), format="csr")
    half.data = rng.normal(size=half.nnz)
    matrix = sparse.csc_array(half @ half.T + sparse.eye_array(3 * nodes))
    matrix.sort_indices()
    return matrix, rng.normal(size=(nodes, 3))


@pytest.mark.parametrize("cores", [1, 2])
@pytest.mark.parametrize(
    "made",
    [
        lambda: tied_slab(),
        lambda: tied_slab(cells=(1, 1, 1)),
        lambda: tied_slab("tetrahedron4", (7, 6, 2)),
        lambda: scattered(0),
        lambda: scattered(1, nodes=200, couplings=150),
    ],
)
def test_solutions_are_those_of_another_solver(made, cores):
    matrix, places = made()
    factor = SparseCholesky(places, cores)
    factor.factorise(matrix)
    right = np.random.default_rng(2).normal(size=(matrix.shape[0], 5))
    expected = spsolve(matrix, right)
    scale = np.abs(expected).max()
    np.testing.assert_allclose(factor.solve(right), expected, atol=1e-9 * scale)
    np.testing.assert_allclose(factor.solve(right[:, 0]), expected[:, 0], atol=1e-9 * scale)


def test_a_shift_is_added_to_the_diagonal():
    matrix, places = scattered(3)
    factor = SparseCholesky(places, 1)
    factor.factorise(matrix, 2.5)
    right = np.arange(float(matrix.shape[0]))
    expected = np.linalg.solve(matrix.toarray() + 2.5 * np.eye(len(right)), right)
    np.testing.assert_allclose(factor.solve(right), expected, rtol=1e-9)


@pytest.mark.parametrize("cores", [1, 2])
def test_matrices_that_bend_down_are_told_from_those_that_do_not(cores):
    matrix, places = tied_slab()
    lowest = np.linalg.eigvalsh(matrix.toarray())[0]
    factor = SparseCholesky(places, cores)
    factor.factorise(matrix, -0.999 * lowest)
    with pytest.raises(NotPositiveDefinite):
        factor.factorise(matrix, -1.001 * lowest)
    broken = matrix.copy()
    broken.data[broken.indices == 7] = np.nan
    with pytest.raises(NotPositiveDefinite):
        factor.factorise(broken)


def test_another_sparsity_is_noticed():
    (slab, places), (other, _) = tied_slab(), tied_slab("tetrahedron4", (5, 4, 2))
    factor = SparseCholesky(places, 1)
    factor.factorise(slab)
    coupled = slab.tolil()
    coupled[0, slab.shape[0] - 1] = coupled[slab.shape[0] - 1, 0] = 1e-3
    coupled = sparse.csc_array(coupled)
    coupled.sort_indices()
    factor.factorise(coupled)
    right = np.ones(slab.shape[0])
    np.testing.assert_allclose(coupled @ factor.solve(right), right, atol=1e-9)
    assert other.shape != slab.shape


def test_both_halves_are_eliminated_at_the_same_time(monkeypatch):
    """A barrier that two threads have to reach: alone, either of them would wait in vain."""
    matrix, places = tied_slab()
    factor = SparseCholesky(places, 2)
    left, _ = plan(matrix, places).halves
    both = threading.Barrier(2, timeout=20)
    plain = factor._eliminate

    def meeting(first, last, entries, shift):
        if first in (0, left):
            both.wait()
        return plain(first, last, entries, shift)

    monkeypatch.setattr(factor, "_eliminate", meeting)
    factor.factorise(matrix)
    right = np.ones(matrix.shape[0])
    np.testing.assert_allclose(matrix @ factor.solve(right), right, atol=1e-9)


def test_separators_part_the_graph():
    matrix, places = tied_slab(cells=(9, 8, 1))
    elimination = plan(matrix, places)
    graph = elimination.graph
    tree = dissect(graph.indptr.astype(np.int64), graph.indices.astype(np.int64), places)
    order = np.concatenate([separator.nodes for separator in tree])
    assert sorted(order) == list(range(len(places)))
    below: list[set[int]] = []
    for separator in tree:
        parts = [below[child] for child in separator.children]
        if parts:
            neighbours = {
                j for i in parts[0] for j in graph.indices[slice(*graph.indptr[i : i + 2])]
            }
            assert not neighbours & parts[1]
        below.append(set(separator.nodes).union(*parts))


def test_work_grows_as_nested_dissection_promises():
    """Entries of the factor of a sheet grow as n log n, not as n^1.5, which a band would need."""
    entries = []
    for cells in (8, 16, 32):
        matrix, places = tied_slab(cells=(cells, cells, 1))
        elimination = plan(matrix, places)
        entries.append(elimination.panel_starts[-1] / matrix.shape[0])
    assert entries[2] / entries[1] < 1.45
    assert entries[1] / entries[0] < 1.6
    assert LEAF_NODES < 100
