import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from defras_sim.scene import Tissue
from defras_sim.tissue.dent import Dent
from defras_sim.tissue.discs import disc_rows, net_force
from defras_sim.tissue.equilibrium import PotentialEnergy
from defras_sim.tissue.mesh import slab_mesh
from defras_sim.tissue.springs import Springs, SpringTerm

CENTER = np.array([[0.011, -0.02]])

SLAB = Tissue().shape


def slab(cells=(8, 8, 1)):
    return slab_mesh(Tissue(), "hexahedron20", cells)


def test_moments_of_a_disc_are_exact():
    mesh = slab()
    x = mesh.nodes_m
    rows = disc_rows(mesh, CENTER, 0.004, SLAB.upper)
    # Over a disc of radius r, the mean of 2 (x - x0) / r times x is r / 2.
    expected = [[0.011, -0.02, 0.0], [0.002, 0.0, 0.0], [0.0, 0.002, 0.0]]
    np.testing.assert_allclose(rows @ x, expected, atol=1e-15)


@pytest.mark.parametrize("cells", [(8, 8, 1), (12, 12, 1), (5, 7, 2)])
def test_a_disc_pulls_and_turns_with_its_stiffness_whatever_the_mesh(cells):
    mesh = slab(cells)
    rows = disc_rows(mesh, CENTER, 0.005, SLAB.upper)
    springs = Springs(rows, np.full(3, 500.0))
    about = np.array([*CENTER[0], 0.0])
    angle = 1e-6
    turn = Rotation.from_rotvec([0.0, angle, 0.0]).as_matrix()
    goal = rows @ ((mesh.nodes_m - about) @ turn.T + about + [0.0, 0.0, 0.002])
    forces = springs.forces(mesh.nodes_m, goal)
    np.testing.assert_allclose(net_force(forces), [[0, 0, 1.0]], atol=1e-12)
    # k r^2 / 4 per radian about a diameter: the mean of the squared lever over the disc.
    levers = rows @ mesh.nodes_m - np.array([[1.0], [0.0], [0.0]]) * about
    moment = np.cross(levers, forces).sum(axis=0)
    assert moment[1] == pytest.approx(500.0 * 0.005**2 / 4 * angle, rel=1e-5)


def test_a_disc_at_the_edge_stays_in_the_slab():
    rows = disc_rows(slab(), np.array([[0.06, 0.06]]), 0.005, SLAB.lower)
    np.testing.assert_allclose(rows.sum(axis=1), [1, 0, 0], atol=1e-12)


def test_gradient_and_tangent_are_slopes():
    mesh = slab((4, 4, 1))
    upper = Springs(disc_rows(mesh, CENTER, 0.004, SLAB.upper), np.full(3, 300.0))
    lower = Springs(disc_rows(mesh, -CENTER, 0.004, SLAB.lower), np.full(3, 1e4))
    rng = np.random.default_rng(0)
    targets = rng.normal(0, 0.02, (2, 3, 3))
    terms = [SpringTerm("upper", upper, targets[0]), SpringTerm("lower", lower, targets[1])]
    springs = PotentialEnergy(len(mesh.nodes_m), terms)
    x = mesh.nodes_m + rng.normal(0, 0.001, mesh.nodes_m.shape)
    step = rng.normal(0, 1e-6, x.shape)
    (up, up_slope), (down, down_slope) = (springs.energy_and_gradient(x + s) for s in (step, -step))
    _, slope = springs.energy_and_gradient(x)
    assert np.sum(slope * step) * 2 == pytest.approx(up - down, rel=1e-8)
    np.testing.assert_allclose(
        springs.tangent(x) @ step.ravel() * 2, (up_slope - down_slope).ravel(), atol=1e-12
    )


def test_gradient_tangent_and_what_stiffness_does_are_slopes_with_dents_too():
    mesh = slab((4, 4, 1))
    rng = np.random.default_rng(0)
    dent = Dent(rng.uniform(0.0, 0.05, 6), rng.uniform(0.02, 0.3, 6))
    centers = np.concatenate([CENTER, -CENTER])
    rows = disc_rows(mesh, centers, 0.004, SLAB.lower)
    springs = Springs(rows, np.array([300.0, 300.0, 300.0, 1e4, 1e4, 0.0]), dent)
    targets = rows @ mesh.nodes_m + rng.normal(0, 0.003, (6, 3))
    x = mesh.nodes_m + rng.normal(0, 0.001, mesh.nodes_m.shape)
    term = SpringTerm("held", springs, targets)
    step = rng.normal(0, 1e-7, x.shape)
    (up, up_slope), (down, down_slope) = (term.energy_and_gradient(x + s) for s in (step, -step))
    _, slope = term.energy_and_gradient(x)
    assert np.sum(slope * step) * 2 == pytest.approx(up - down, rel=1e-6)
    tangent = PotentialEnergy(len(x), [term]).tangent(x)
    change = (up_slope - down_slope).ravel()
    np.testing.assert_allclose(tangent @ step.ravel() * 2, change, atol=1e-6 * abs(change).max())
    np.testing.assert_allclose((tangent - tangent.T).toarray(), 0, atol=1e-12)
    firmer, looser = (
        Springs(rows, springs.stiffness_n_per_m + s, dent).forces(x, targets) for s in (1e-4, 0.0)
    )
    by_stiffness = springs.pulls(x, targets).forces_by_stiffness
    np.testing.assert_allclose((firmer - looser) / 1e-4, by_stiffness, rtol=1e-3, atol=1e-12)


def test_the_held_disc_lies_where_its_own_spring_pulls_it():
    """Dent and spring share the stretch: the spring's part is its force over its stiffness."""
    mesh = slab((4, 4, 1))
    rows = disc_rows(mesh, CENTER, 0.004, SLAB.upper)
    springs = Springs(rows, np.full(3, 80.0), Dent(np.full(3, 0.03), np.full(3, 0.1)))
    targets = rows @ mesh.nodes_m + [0.001, 0.0, 0.004]
    pulls = springs.pulls(mesh.nodes_m, targets)
    np.testing.assert_allclose(pulls.forces_n, 80.0 * (targets - pulls.held_m), atol=1e-12)
