"""The three plug points, each with a term that a user might write."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Attachments, Roi, Scene, Tissue
from defras_sim.tissue.assembly import ElasticBody
from defras_sim.tissue.equilibrium import PotentialEnergy
from defras_sim.tissue.loads import DeadLoad, gravity
from defras_sim.tissue.material_points import MaterialPoints, MaterialTerm
from defras_sim.tissue.materials import lame_parameters
from defras_sim.tissue.mesh import Integers, slab_mesh
from defras_sim.tissue.model import TissueModel
from defras_sim.tissue.parameters import TermParameter
from defras_sim.tissue.prestress import Prestress, second_piola_pa
from defras_sim.tissue.terms import BoundaryTerm, Term, unknown_parameter

SMALL = Tissue(length_x_m=0.03, width_y_m=0.02, thickness_m=0.01)
MESH = slab_mesh(SMALL, "hexahedron20", (3, 2, 2))


@dataclass(frozen=True)
class Fibres(MaterialTerm):
    """Fibres along ``direction`` (3,), W = k/2 (|F a|^2 - 1)^2."""

    points: MaterialPoints
    direction: Floats
    stiffness_pa: float
    name: str = "fibres"
    parameters = ("stiffness_pa",)

    def density_and_stress(self, F: Floats) -> tuple[Floats, Floats]:
        along = F @ self.direction
        excess = np.sum(along**2, axis=-1) - 1
        pull = 2 * self.stiffness_pa * excess[..., None] * along
        return self.stiffness_pa / 2 * excess**2, pull[..., :, None] * self.direction

    def stress_tangent(self, F: Floats) -> Floats:
        along = F @ self.direction
        excess = np.sum(along**2, axis=-1) - 1
        inner = 2 * along[..., :, None] * along[..., None, :] + excess[..., None, None] * np.eye(3)
        spread = np.outer(self.direction, self.direction)
        tangent = 2 * self.stiffness_pa * np.einsum("eqik,jl->eqijkl", inner, spread)
        return tangent.reshape(*F.shape[:2], 9, 9)

    def stress_by(self, parameter: str, F: Floats) -> Floats:
        if parameter != "stiffness_pa":
            raise unknown_parameter(self, parameter)
        return replace(self, stiffness_pa=1.0).density_and_stress(F)[1]


@dataclass(frozen=True)
class Strut(BoundaryTerm):
    """A linear spring between two nodes, of rest length ``length_m``."""

    pairs: Integers
    stiffness_n_per_m: float
    length_m: float
    name: str = "strut"
    parameters = ("length_m",)

    @staticmethod
    def between(first: int, second: int, stiffness_n_per_m: float, length_m: float) -> "Strut":
        ends = [(first, first), (first, second), (second, first), (second, second)]
        return Strut(np.array(ends), stiffness_n_per_m, length_m)

    def _along(self, x: Floats) -> tuple[Floats, float]:
        offset = x[self.pairs[3, 0]] - x[self.pairs[0, 0]]
        length = float(np.linalg.norm(offset))
        return offset / length, length

    def _on_ends(self, pull: Floats, x: Floats) -> Floats:
        gradient = np.zeros_like(x)
        gradient[self.pairs[3, 0]] = pull
        gradient[self.pairs[0, 0]] = -pull
        return gradient

    def energy_and_gradient(self, positions_m: Floats) -> tuple[float, Floats]:
        unit, length = self._along(positions_m)
        stretch = length - self.length_m
        pull = self.stiffness_n_per_m * stretch * unit
        return self.stiffness_n_per_m / 2 * stretch**2, self._on_ends(pull, positions_m)

    def blocks(self, positions_m: Floats) -> Floats:
        unit, length = self._along(positions_m)
        along = np.outer(unit, unit)
        block = self.stiffness_n_per_m * (
            along + (1 - self.length_m / length) * (np.eye(3) - along)
        )
        return np.stack([block, -block, -block, block])

    def gradient_by(self, parameter: str, positions_m: Floats) -> Floats:
        if parameter != "length_m":
            raise unknown_parameter(self, parameter)
        unit, _ = self._along(positions_m)
        return self._on_ends(-self.stiffness_n_per_m * unit, positions_m)


def body(material: str = "neo_hookean") -> ElasticBody:
    return ElasticBody(MESH, material, *lame_parameters(material, 3000.0, 0.45))


def shaken(seed: int = 0) -> Floats:
    """Stretched, sheared, waved."""
    x = MESH.nodes_m
    F = np.array([[1.15, 0.1, 0.0], [-0.05, 0.95, 0.1], [0.0, 0.1, 1.05]])
    noise = np.random.default_rng(seed).normal(0, 5e-5, x.shape)
    return x @ F.T + 0.001 * np.sin(120 * x[:, [1, 2, 0]]) + noise


def prestress() -> Prestress:
    points = body().points
    field = np.random.default_rng(1).normal(0, 300.0, (*points.volumes_m3.shape, 3, 3))
    return Prestress(points, field + np.swapaxes(field, -1, -2))


TERMS: dict[str, Term] = {
    "fibres": Fibres(body().points, np.array([0.6, 0.8, 0.0]), 700.0),
    "prestress": prestress(),
    "strut": Strut.between(3, 60, 50.0, 0.004),
    "gravity": gravity(body().points, 1000.0, 9.81),
}
CHANGED = {
    "fibres": ("stiffness_pa", lambda d: replace(TERMS["fibres"], stiffness_pa=700.0 + d)),
    "prestress": ("strength", lambda d: replace(TERMS["prestress"], strength=1.0 + d)),
    "strut": ("length_m", lambda d: replace(TERMS["strut"], length_m=0.004 + d)),
    "gravity": ("acceleration_m_s2", lambda d: replace(TERMS["gravity"], strength=9.81 + d)),
}


@pytest.mark.parametrize("name", TERMS)
def test_every_derivative_of_a_term_is_a_slope(name: str) -> None:
    term, x = TERMS[name], shaken()
    step = 1e-7 * np.random.default_rng(2).normal(size=x.shape)
    (up, up_slope), (down, down_slope) = (term.energy_and_gradient(x + s) for s in (step, -step))
    _, gradient = term.energy_and_gradient(x)
    assert 2 * np.sum(gradient * step) == pytest.approx(up - down, rel=1e-5)
    tangent = PotentialEnergy(len(x), [term]).tangent(x)
    assert abs(tangent - tangent.T).sum() <= 1e-12 * abs(tangent).sum()
    slope = (up_slope - down_slope).ravel()
    assert np.linalg.norm(2 * tangent @ step.ravel() - slope) <= 1e-6 * np.linalg.norm(slope)
    parameter, changed = CHANGED[name]
    ends = [changed(sign * 1e-5).energy_and_gradient(x)[1] for sign in (1, -1)]
    np.testing.assert_allclose(
        term.gradient_by(parameter, x), (ends[0] - ends[1]) / 2e-5, rtol=1e-6, atol=1e-9
    )
    with pytest.raises(
        ValueError, match=f"'{name}' has no parameter 'colour'; it has: {parameter}"
    ):
        term.gradient_by("colour", x)


def test_terms_add_up() -> None:
    x, terms = shaken(), [body(), *TERMS.values()]
    together = PotentialEnergy(len(x), terms)
    alone = [PotentialEnergy(len(x), [term]) for term in terms]
    energies, gradients = zip(*(each.energy_and_gradient(x) for each in alone), strict=True)
    energy, gradient = together.energy_and_gradient(x)
    assert energy == pytest.approx(sum(energies), rel=1e-12)
    np.testing.assert_allclose(gradient, sum(gradients), rtol=0, atol=1e-12)
    tangent = sum(each.tangent(x).toarray() for each in alone)
    np.testing.assert_allclose(together.tangent(x).toarray(), tangent, atol=1e-10)


def test_a_changed_term_keeps_the_matrix_laid_out_and_leaves_the_energy_before_as_it_was() -> None:
    x = shaken()
    energy = PotentialEnergy(len(x), [body(), *TERMS.values()])
    before = energy.energy_and_gradient(x)[0]
    changed = energy.with_term(CHANGED["strut"][1](0.001))
    assert changed.tangent(x).indices is not None
    assert np.shares_memory(changed.tangent(x).indices, energy.tangent(x).indices)
    assert energy.energy_and_gradient(x)[0] == before
    assert changed.energy_and_gradient(x)[0] != before
    without = changed.without_term("strut")
    assert "strut" not in without.terms
    with pytest.raises(KeyError, match="no term is called 'strut'; there are: material"):
        without.without_term("strut")
    with pytest.raises(ValueError, match="two terms are called 'strut'"):
        PotentialEnergy(len(x), [TERMS["strut"], TERMS["strut"]])


def test_weight_is_consistent_with_the_shape_functions() -> None:
    """The work of the nodal forces along any linear motion is the weight times that of the centre
    of mass."""
    load = gravity(body().points, 1100.0, 9.81)
    forces = -load.energy_and_gradient(MESH.nodes_m)[1]
    weight = 1100.0 * 9.81 * SMALL.length_x_m * SMALL.width_y_m * SMALL.thickness_m
    np.testing.assert_allclose(forces.sum(axis=0), [0, 0, -weight], atol=1e-12)
    F = np.random.default_rng(3).normal(size=(3, 3))
    centre = MESH.nodes_m.min(axis=0) / 2 + MESH.nodes_m.max(axis=0) / 2
    assert np.sum(forces * (MESH.nodes_m @ F.T)) == pytest.approx(-weight * (F @ centre)[2])


def test_prestress_can_hold_what_strain_makes() -> None:
    """Minus the body's own second Piola stress takes all force away: full relaxation."""
    elastic, x = body(), shaken()
    F = elastic.points.deformation(x)
    own = second_piola_pa(F, elastic.stress_pa(F))
    np.testing.assert_allclose(own, np.swapaxes(own, -1, -2), atol=1e-9 * np.abs(own).max())
    relaxed = PotentialEnergy(len(x), [elastic, Prestress(elastic.points, -own)])
    force = np.abs(elastic.energy_and_gradient(x)[1]).max()
    assert np.abs(relaxed.energy_and_gradient(x)[1]).max() < 1e-10 * force


@pytest.mark.parametrize("material", ["corotational", "neo_hookean", "stable_neo_hookean"])
def test_a_thicker_rest_shape_is_the_mesh_of_thicker_tissue(material: str) -> None:
    scale = 1.3
    thick = Tissue(length_x_m=0.03, width_y_m=0.02, thickness_m=0.01 * scale)
    lame = lame_parameters(material, 3000.0, 0.45)
    other = ElasticBody(slab_mesh(thick, "hexahedron20", (3, 2, 2)), material, *lame)
    thin, x = body(material), shaken()
    thickened = thin.with_points(thin.points.thickened(scale))
    energy, gradient = thickened.energy_and_gradient(x)
    assert energy == pytest.approx(other.energy_and_gradient(x)[0], rel=1e-10)
    scale_n = np.abs(gradient).max()
    np.testing.assert_allclose(gradient, other.energy_and_gradient(x)[1], atol=1e-10 * scale_n)


def clamped_scene(**tissue: float) -> Scene:
    return Scene(
        name="plugged",
        attachments=Attachments(map=("##........##",) * 12),
        roi=Roi(center_x_m=0.0, center_y_m=0.0),
        tissue=Tissue(**tissue),
    )


TIP = Pose(np.array([0.0, 0.0, 0.0]))
UP = TIP.moved(np.array([0.0, 0.0, 0.012]))


def lifted(tissue: TissueModel) -> float:
    """Force of the lift."""
    if not tissue.grasped_arms:
        tissue.grasp("psm1", TIP)
    state = tissue.solve({"psm1": UP})
    assert state.converged
    return float(state.grasp_forces_n["psm1"][2])


def test_a_plugged_in_material_stiffens_the_tissue_and_is_differentiated() -> None:
    tissue = TissueModel(clamped_scene(), elements_xyz=(5, 5, 1), residual_share=1e-11)
    plain = lifted(tissue)
    material = tissue.terms["material"]
    assert isinstance(material, ElasticBody)
    fibres = Fibres(material.points, np.array([1.0, 0.0, 0.0]), 0.0)
    tissue.set_term(fibres)
    assert lifted(tissue) == pytest.approx(plain, rel=1e-9)  # the null value
    tissue.set_term(replace(fibres, stiffness_pa=800.0))
    stiff = lifted(tissue)
    assert stiff > 1.1 * plain
    by = tissue.sensitivities([TermParameter("fibres", "stiffness_pa")])
    ends = []
    for sign in (1, -1):
        tissue.set_term(replace(fibres, stiffness_pa=800.0 + sign * 0.1))
        ends.append(lifted(tissue))
    assert by.grasp_forces_by["psm1"][2, 0] == pytest.approx((ends[0] - ends[1]) / 0.2, rel=1e-4)
    tissue.remove_term("fibres")
    assert lifted(tissue) == pytest.approx(plain, rel=1e-9)


def test_stress_of_plugged_in_materials_counts() -> None:
    tissue = TissueModel(clamped_scene(), elements_xyz=(5, 5, 1))
    material = tissue.terms["material"]
    assert isinstance(material, ElasticBody)
    field = np.zeros((*material.points.volumes_m3.shape, 3, 3))
    field[:, :, 0, 0] = 50.0
    before = tissue.solve({})
    assert before.largest_principal_stress_pa == pytest.approx(0.0, abs=1e-9)
    tissue.set_term(Prestress(material.points, field))
    after = tissue.solve({})
    assert after.converged
    assert after.largest_principal_stress_pa > 20.0


def test_a_bed_that_moves_takes_the_tissue_along() -> None:
    """Breathing: the bed of the next moment takes the place of the last one's."""
    tissue = TissueModel(clamped_scene(gravity_m_s2=9.81), elements_xyz=(5, 5, 1))
    free = [tissue.solve({}).nodes_m[:, 2].min()]
    tissue.set_hole_stiffness(np.zeros_like(tissue.hole_stiffness_n_per_m))
    tissue.grasp("psm1", TIP)
    bed = tissue.terms["bed"]
    for rise_m in (0.0, 0.002, 0.004):
        tissue.set_term(replace(bed, height_m=bed.height_m + rise_m))
        state = tissue.solve({"psm1": TIP})
        assert state.converged
        free.append(state.nodes_m[:, 2].min())
    np.testing.assert_allclose(np.diff(free), [0.0, 0.002, 0.002], atol=2e-4)


def test_terms_of_holes_and_grasps_are_not_set_by_hand() -> None:
    tissue = TissueModel(clamped_scene(), elements_xyz=(4, 4, 1))
    with pytest.raises(ValueError, match="use set_hole_stiffness"):
        tissue.set_term(tissue.terms["attachments"])
    with pytest.raises(ValueError, match="no term 'wind' to take away; there are: gravity, bed"):
        tissue.remove_term("wind")
    with pytest.raises(ValueError, match="no term 'material'"):
        tissue.remove_term("material")
    assert isinstance(tissue.terms["gravity"], DeadLoad)
