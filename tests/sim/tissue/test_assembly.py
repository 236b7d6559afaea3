import numpy as np
import pytest
from scipy import sparse
from scipy.spatial.transform import Rotation

from defras_sim.scene import Tissue
from defras_sim.tissue.assembly import ElasticBody
from defras_sim.tissue.equilibrium import PotentialEnergy
from defras_sim.tissue.materials import lame_parameters
from defras_sim.tissue.mesh import SlabMesh, slab_mesh
from defras_sim.tissue.readout import largest_principal_stress

MATERIALS = ["corotational", "neo_hookean", "stable_neo_hookean"]
ELEMENTS = ["hexahedron20", "tetrahedron4"]


def body(element: str, material: str, cells=(3, 2, 2)) -> ElasticBody:
    tissue = Tissue(length_x_m=0.03, width_y_m=0.02, thickness_m=0.01)
    return ElasticBody(
        slab_mesh(tissue, element, cells), material, *lame_parameters(material, 3000.0, 0.45)
    )


def shaken(mesh: SlabMesh) -> np.ndarray:
    """A large smooth deformation of the mesh, plus a little noise."""
    x = mesh.nodes_m
    bent = Rotation.from_rotvec([0.3, 0.5, -0.8]).apply(x * [1.2, 0.9, 1.0])
    wave = 0.003 * np.sin(150 * x[:, [1, 2, 0]])
    return bent + wave + np.random.default_rng(5).normal(0, 5e-5, x.shape)


def tangent(elastic: ElasticBody, positions: np.ndarray) -> sparse.csc_array:
    return PotentialEnergy(len(positions), [elastic]).tangent(positions)


@pytest.mark.parametrize("element", ELEMENTS)
@pytest.mark.parametrize("material", MATERIALS)
class TestEveryElementAndMaterial:
    def test_gradient_is_the_slope_of_the_energy(self, element, material):
        elastic = body(element, material)
        x = shaken(elastic.mesh)
        _, gradient = elastic.energy_and_gradient(x)
        rng = np.random.default_rng(0)
        for _ in range(5):
            step = 1e-7 * rng.normal(size=x.shape)
            rise = (
                elastic.energy_and_gradient(x + step)[0] - elastic.energy_and_gradient(x - step)[0]
            )
            assert np.sum(gradient * step) * 2 == pytest.approx(rise, rel=1e-5)

    def test_tangent_is_symmetric_and_the_slope_of_the_gradient(self, element, material):
        elastic = body(element, material)
        x = shaken(elastic.mesh)
        K = tangent(elastic, x)
        assert abs(K - K.T).max() < 1e-12 * abs(K).max()
        step = 1e-7 * np.random.default_rng(0).normal(size=x.shape)
        up, down = (elastic.energy_and_gradient(x + s)[1] for s in (step, -step))
        expected = (up - down).ravel() / 2
        error = np.linalg.norm(K @ step.ravel() - expected)
        assert error < 1e-6 * np.linalg.norm(expected)

    def test_rigid_motion_gives_no_force(self, element, material):
        elastic = body(element, material)
        turn = Rotation.from_rotvec([1.0, 2.0, -1.5]).as_matrix()
        moved = elastic.mesh.nodes_m @ turn.T + [0.1, -0.2, 0.3]
        energy, gradient = elastic.energy_and_gradient(moved)
        reference = np.abs(elastic.energy_and_gradient(elastic.mesh.nodes_m * 1.1)[1]).max()
        assert np.abs(gradient).max() < 1e-8 * reference
        assert abs(energy) < 1e-14

    def test_patch_test(self, element, material):
        """A homogeneous deformation, on distorted elements, balances at every inner node."""
        elastic = distorted(body(element, material), material)
        x = elastic.mesh.nodes_m
        F = np.array([[1.2, 0.1, 0.0], [-0.1, 0.9, 0.2], [0.05, 0.0, 1.1]])
        _, gradient = elastic.energy_and_gradient(x @ F.T)
        low, high = x.min(axis=0), x.max(axis=0)
        inner = np.all((x > low + 1e-6) & (x < high - 1e-6), axis=1)
        assert inner.any()
        assert np.abs(gradient[inner]).max() < 1e-9 * np.abs(gradient).max()

    def test_no_net_force_or_moment_from_inside(self, element, material):
        elastic = body(element, material)
        x = shaken(elastic.mesh)
        _, gradient = elastic.energy_and_gradient(x)
        scale = np.abs(gradient).sum()
        assert np.abs(gradient.sum(axis=0)).max() < 1e-12 * scale
        assert np.abs(np.cross(x, gradient).sum(axis=0)).max() < 1e-12 * scale


def distorted(elastic: ElasticBody, material: str) -> ElasticBody:
    """The same box with its inner corners displaced; edges stay straight."""
    mesh = elastic.mesh
    x = mesh.nodes_m.copy()
    size = np.ptp(x, axis=0)
    unit = (x - x.min(axis=0)) / size
    # Trilinear within each cell, zero on the boundary: displace corners, then re-interpolate.
    bump = np.prod(np.sin(np.pi * unit), axis=1) > 0.3
    corners = np.unique(
        mesh.connectivity[:, :8] if mesh.connectivity.shape[1] == 20 else mesh.connectivity
    )
    moved = np.zeros(len(x), dtype=bool)
    moved[corners] = bump[corners]
    shift = np.where(moved[:, None], 0.12 * size / np.array(mesh.cells_xyz) * [1, -1, 0.5], 0.0)
    if mesh.connectivity.shape[1] == 20:
        ends = [
            (0, 1),
            (1, 2),
            (2, 3),
            (3, 0),
            (4, 5),
            (5, 6),
            (6, 7),
            (7, 4),
            (0, 4),
            (1, 5),
            (2, 6),
            (3, 7),
        ]
        for element in mesh.connectivity:
            for number, (a, b) in enumerate(ends):
                shift[element[8 + number]] = (shift[element[a]] + shift[element[b]]) / 2
    moved_mesh = SlabMesh(
        mesh.element, x + shift, mesh.connectivity, mesh.origin_m, mesh.cell_m, mesh.cells_xyz
    )
    return ElasticBody(moved_mesh, material, *lame_parameters(material, 3000.0, 0.45))


@pytest.mark.parametrize("material", MATERIALS)
def test_stiffness_may_differ_from_point_to_point(material):
    """Energies of uniform bodies mix as the field says, and the gradient is still its slope."""
    uniform = body("hexahedron20", material)
    x = shaken(uniform.mesh)
    shape = uniform.mu_pa.shape
    share = np.random.default_rng(1).uniform(0.2, 3.0, shape)
    mixed = ElasticBody(uniform.mesh, material, share * uniform.mu_pa, share * uniform.lam_pa)
    step = 1e-7 * np.random.default_rng(2).normal(size=x.shape)
    up, down = (mixed.energy_and_gradient(x + s) for s in (step, -step))
    _, gradient = mixed.energy_and_gradient(x)
    assert np.sum(gradient * step) * 2 == pytest.approx(up[0] - down[0], rel=1e-5)
    slope = tangent(mixed, x) @ step.ravel() * 2
    assert np.linalg.norm(slope - (up[1] - down[1]).ravel()) < 1e-6 * np.linalg.norm(slope)
    alone = 0.0
    for element, point in np.ndindex(shape):
        only = np.full(shape, 1e-12)
        only[element, point] = share[element, point]
        part = ElasticBody(uniform.mesh, material, only * uniform.mu_pa, only * uniform.lam_pa)
        alone += part.energy_and_gradient(x)[0]
    assert mixed.energy_and_gradient(x)[0] == pytest.approx(alone, rel=1e-6)


def test_only_the_rigid_motions_are_free():
    """The integration rule adds no spurious modes: six zero eigenvalues, then bending."""
    elastic = ElasticBody(
        slab_mesh(Tissue(), "hexahedron20", (4, 4, 1)),
        "neo_hookean",
        *lame_parameters("neo_hookean", 3000.0, 0.45),
    )
    values = np.linalg.eigvalsh(tangent(elastic, elastic.mesh.nodes_m).toarray())
    assert np.abs(values[:6]).max() < 1e-9
    assert values[6] > 1e-3


def test_principal_stress_of_uniaxial_tension():
    elastic = body("hexahedron20", "neo_hookean")
    mu, lam = lame_parameters("neo_hookean", 3000.0, 0.45)
    stretched = elastic.mesh.nodes_m * [1.3, 0.9, 0.9]
    J = 1.3 * 0.9**2
    expected = (mu * (1.3**2 - 1) + lam * np.log(J)) / J
    largest_pa, position_m = largest_principal_stress([elastic], stretched)
    assert largest_pa == pytest.approx(expected, rel=1e-10)
    assert np.all(position_m >= stretched.min(axis=0))
    assert np.all(position_m <= stretched.max(axis=0))


def test_an_inverted_mesh_is_refused():
    mesh = slab_mesh(Tissue(), "tetrahedron4", (1, 1, 1))
    flipped = SlabMesh(
        mesh.element,
        mesh.nodes_m * [1, 1, -1],
        mesh.connectivity,
        mesh.origin_m,
        mesh.cell_m,
        (1, 1, 1),
    )
    with pytest.raises(ValueError, match="inverted"):
        ElasticBody(flipped, "neo_hookean", 1000.0, 1000.0)
