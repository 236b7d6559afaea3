"""The whole chain against numbers from elsewhere: felupe, beam theory, the converged slab table."""

import felupe
import numpy as np
import pytest
from scipy import sparse

from defras_sim.scene import Tissue
from defras_sim.tissue.assembly import ElasticBody
from defras_sim.tissue.discs import ROW_SHIFTS, disc_rows
from defras_sim.tissue.elements import gauss_hexahedron
from defras_sim.tissue.equilibrium import PotentialEnergy
from defras_sim.tissue.materials import lame_parameters
from defras_sim.tissue.mesh import slab_mesh
from defras_sim.tissue.solver import NewtonSettings, NewtonSolver
from defras_sim.tissue.springs import Springs, SpringTerm

E, NU = 3000.0, 0.45
PRESCRIBED_N_PER_M = 1e7  # far above the stiffest mode of the mesh, 4e3 N/m


def slab_body(element: str, cells: tuple[int, int, int], rule=None, tissue=None) -> ElasticBody:
    mesh = slab_mesh(tissue or Tissue(), element, cells)
    return ElasticBody(mesh, "neo_hookean", *lame_parameters("neo_hookean", E, NU), rule)


def lift_forces(body: ElasticBody, held: Springs, shifts, lifts_m) -> list[float]:
    """Vertical force on ``held`` lifted straight up; the edges at +-x are clamped."""
    x = body.mesh.nodes_m
    clamped = np.abs(np.abs(x[:, 0]) - 0.06) < 1e-9
    nodes = sparse.eye_array(len(x), format="csr")
    clamp = Springs(nodes[np.flatnonzero(clamped)], np.full(clamped.sum(), PRESCRIBED_N_PER_M))
    clamps = SpringTerm("clamp", clamp, clamp.rows @ x)
    solver = NewtonSolver(NewtonSettings(residual_n=1e-7))
    positions, forces = x, []
    for lift in np.arange(0.0025, max(lifts_m) + 1e-9, 0.0025):
        lifted = SpringTerm("held", held, held.rows @ x + shifts[:, None] * [0, 0, lift])
        energy = PotentialEnergy(len(x), [body, clamps, lifted])
        solution = solver.minimise(energy, positions)
        assert solution.converged
        positions = solution.positions_m
        if np.isclose(lift, lifts_m).any():
            forces.append(shifts @ lifted.forces_n(positions)[:, 2])
    return forces


def lift_nodes(body: ElasticBody, lifts_m) -> list[float]:
    """As in the slab table: all nodes within 10 mm of the middle, through the thickness."""
    x = body.mesh.nodes_m
    near = np.flatnonzero(np.hypot(x[:, 0], x[:, 1]) < 0.010 + 1e-9)
    nodes = sparse.eye_array(len(x), format="csr")[near]
    springs = Springs(nodes, np.full(len(near), PRESCRIBED_N_PER_M))
    return lift_forces(body, springs, np.ones(len(near)), lifts_m)


def test_converged_forces_of_the_slab_are_met():
    """27-node hexahedra, 24x24x1: 0.0120, 0.0542, 0.1338 N at 10, 20, 30 mm of lift."""
    forces = lift_nodes(slab_body("hexahedron20", (8, 8, 1)), [0.01, 0.02, 0.03])
    np.testing.assert_allclose(forces, [0.0120, 0.0542, 0.1338], rtol=0.10)


def test_a_disc_held_by_interpolation_hardly_depends_on_the_mesh():
    """The disc of the same radius is held a little less firmly than all nodes in and near it."""
    found = []
    for cells in ((8, 8, 1), (12, 12, 1)):
        body = slab_body("hexahedron20", cells)
        held = Springs(
            disc_rows(body.mesh, np.zeros((1, 2)), 0.010, Tissue().shape.upper), np.full(3, 1e4)
        )
        found.append(lift_forces(body, held, ROW_SHIFTS, [0.01, 0.02]))
    np.testing.assert_allclose(found[0], found[1], rtol=0.10)
    np.testing.assert_allclose(found[1], [0.0120, 0.0542], rtol=0.20)


def test_linear_tetrahedra_misjudge_the_force_as_known():
    """They read several times too much: 0.0416 and 0.1028 N (felupe, 12x12x1)."""
    forces = lift_nodes(slab_body("tetrahedron4", (12, 12, 1)), [0.01, 0.02])
    np.testing.assert_allclose(forces, [0.0416, 0.1028], rtol=0.01)


def test_quadratic_tetrahedra_read_what_felupe_reads():
    """0.0131 and 0.0565 N at 10 and 20 mm (felupe, 10-node tetrahedra, 12x12x1)."""
    forces = lift_nodes(slab_body("tetrahedron10", (12, 12, 1)), [0.01, 0.02])
    np.testing.assert_allclose(forces, [0.0131, 0.0565], rtol=0.005)


def test_forces_are_those_of_felupe_on_the_same_mesh():
    body = slab_body("hexahedron20", (4, 4, 1), gauss_hexahedron(3))
    ours = lift_nodes(body, [0.01])[0]
    mesh = felupe.Cube(a=(-0.06, -0.06, -0.005), b=(0.06, 0.06, 0.0), n=(5, 5, 2))
    region = felupe.RegionQuadraticHexahedron(mesh.add_midpoints_edges())
    field = felupe.FieldContainer([felupe.Field(region, dim=3)])
    mu, lam = lame_parameters("neo_hookean", E, NU)
    solid = felupe.SolidBody(felupe.NeoHookeCompressible(mu=mu, lmbda=lam), field)
    x = region.mesh.points
    near = np.hypot(x[:, 0], x[:, 1]) < 0.010 + 1e-9
    bounds = {
        "clamp": felupe.Boundary(field[0], mask=np.abs(np.abs(x[:, 0]) - 0.06) < 1e-9),
        "hold": felupe.Boundary(field[0], mask=near, skip=(0, 0, 1)),
        "lift": felupe.Boundary(field[0], mask=near, skip=(1, 1, 0)),
    }
    for lift in (0.0025, 0.005, 0.0075, 0.01):
        bounds["lift"].value = lift
        free, fixed = felupe.dof.partition(field, bounds)
        prescribed = felupe.dof.apply(field, bounds, free)
        felupe.newtonraphson(items=[solid], dof0=free, dof1=fixed, ext0=prescribed, verbose=0)
    forces = np.asarray(solid.assemble.vector(field).todense()).reshape(-1, 3)
    assert ours == pytest.approx(forces[near, 2].sum(), rel=2e-3)


@pytest.mark.parametrize("material", ["corotational", "neo_hookean", "stable_neo_hookean"])
def test_slender_cantilever_bends_as_beam_theory_says(material):
    length, width, height = 0.1, 0.004, 0.004
    tissue = Tissue(length_x_m=length, width_y_m=width, thickness_m=height)
    mesh = slab_mesh(tissue, "hexahedron20", (20, 1, 1))
    # Poisson's ratio 0: the clamp does not hinder the cross-section, as in beam theory.
    body = ElasticBody(mesh, material, *lame_parameters(material, E, 0.0))
    x = mesh.nodes_m
    clamped = np.flatnonzero(x[:, 0] < -length / 2 + 1e-9)
    tip = np.flatnonzero(x[:, 0] > length / 2 - 1e-9)
    nodes = sparse.eye_array(len(x), format="csr")
    mean = sparse.csr_array(np.full((1, len(tip)), 1 / len(tip)) @ nodes[tip].toarray())
    targets = np.concatenate([x[clamped], mean @ x + [[0, 0, 1.0]]])
    load = 1e-6  # a spring a metre long, so soft that it is a dead load
    rows = sparse.csr_array(sparse.vstack([nodes[clamped], mean], format="csr"))
    springs = Springs(rows, np.concatenate([np.full(len(clamped), PRESCRIBED_N_PER_M), [load]]))
    energy = PotentialEnergy(len(x), [body, SpringTerm("held", springs, targets)])
    solution = NewtonSolver(NewtonSettings(residual_n=1e-10)).minimise(energy, x)
    assert solution.converged
    deflection = (mean @ solution.positions_m - mean @ x)[0, 2]
    inertia = width * height**3 / 12
    expected = load * length**3 / (3 * E * inertia)
    assert expected < 0.1 * length
    assert deflection == pytest.approx(expected, rel=0.02)
