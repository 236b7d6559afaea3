"""Terms that effects put beside the base material or in its place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from defras_sim.geometry import Floats
from defras_sim.scene import Tissue
from defras_sim.tissue.adhesion import Adhesion
from defras_sim.tissue.assembly import ElasticBody
from defras_sim.tissue.equilibrium import PotentialEnergy
from defras_sim.tissue.fading import Fading, Step
from defras_sim.tissue.fibres import Fibres
from defras_sim.tissue.material_points import MaterialTerm
from defras_sim.tissue.materials import lame_parameters
from defras_sim.tissue.mesh import slab_mesh
from defras_sim.tissue.prestress import second_piola_pa
from defras_sim.tissue.softened import Softened, SofteningAhead, density_and_stress
from defras_sim.tissue.stiffening import Stiffening
from defras_sim.tissue.terms import Term

SMALL = Tissue(length_x_m=0.03, width_y_m=0.02, thickness_m=0.01)
MESH = slab_mesh(SMALL, "hexahedron20", (3, 2, 2))
BODY = ElasticBody(MESH, "neo_hookean", *lame_parameters("neo_hookean", 3000.0, 0.45))
POINTS = BODY.points


def shaken(seed: int = 0) -> Floats:
    """Stretched, sheared, waved."""
    x = MESH.nodes_m
    F = np.array([[1.15, 0.1, 0.0], [-0.05, 0.95, 0.1], [0.0, 0.1, 1.05]])
    noise = np.random.default_rng(seed).normal(0, 5e-5, x.shape)
    return np.asarray(x @ F.T + 0.001 * np.sin(120 * x[:, [1, 2, 0]]) + noise)


def stretched(F: Floats) -> Floats:
    """Deformation gradients of a homogeneous state."""
    return np.broadcast_to(F, (*POINTS.volumes_m3.shape, 3, 3)).copy()


STIFFENING = Stiffening(POINTS, BODY.shear_pa, 0.7)
FIBRES = Fibres(POINTS, BODY.young_pa, 2.0, 0.6).with_others((0.3, 1.2))
# Some points below the largest energy so far, some above it.
LARGEST = np.random.default_rng(5).uniform(0, 250.0, POINTS.volumes_m3.shape)
SOFTENED = Softened(POINTS, (BODY, STIFFENING), LARGEST, 0.4, 0.6)
STUCK = Adhesion.of(MESH, SMALL.shape.lower, MESH.nodes_m, 80.0, 0.0015)
ADHESION = STUCK.with_farthest(np.random.default_rng(6).uniform(0, 0.004, STUCK.farthest_m.shape))


@dataclass(frozen=True)
class Case:
    term: Term
    changed: dict[str, Callable[[float], Term]]


CASES = {
    "stiffening": Case(
        STIFFENING,
        {
            "coefficient": lambda d: replace(STIFFENING, coefficient=0.7 + d),
            "stiffness_scale": lambda d: STIFFENING.scaled(1 + d),
        },
    ),
    "fibres": Case(
        FIBRES,
        {
            "strength": lambda d: replace(FIBRES, strength=2.0 + d),
            "angle_rad": lambda d: replace(FIBRES, angle_rad=0.6 + d),
            "stiffness_scale": lambda d: FIBRES.scaled(1 + d),
            "strength_1": lambda d: replace(FIBRES, strength=d, angle_rad=1.2),
        },
    ),
    "softened": Case(
        SOFTENED,
        {
            "share": lambda d: replace(SOFTENED, share=0.4 + d),
            "width": lambda d: replace(SOFTENED, width=0.6 + d),
            "stiffness_scale": lambda d: SOFTENED.scaled(1 + d),
        },
    ),
    "adhesion": Case(ADHESION, {"strength_pa": lambda d: replace(ADHESION, strength_pa=80.0 + d)}),
}


@pytest.mark.parametrize("name", CASES)
def test_every_derivative_is_a_slope(name: str) -> None:
    term, x = CASES[name].term, shaken()
    step = 1e-7 * np.random.default_rng(2).normal(size=x.shape)
    (up, up_slope), (down, down_slope) = (term.energy_and_gradient(x + s) for s in (step, -step))
    _, gradient = term.energy_and_gradient(x)
    assert 2 * np.sum(gradient * step) == pytest.approx(up - down, rel=1e-5)
    tangent = PotentialEnergy(len(x), [term]).tangent(x)
    assert abs(tangent - tangent.T).sum() <= 1e-12 * abs(tangent).sum()
    slope = (up_slope - down_slope).ravel()
    assert np.linalg.norm(2 * tangent @ step.ravel() - slope) <= 1e-6 * np.linalg.norm(slope)
    for parameter, changed in CASES[name].changed.items():
        ends = [changed(sign * 1e-5).energy_and_gradient(x)[1] for sign in (1, -1)]
        np.testing.assert_allclose(
            term.gradient_by(parameter, x), (ends[0] - ends[1]) / 2e-5, rtol=1e-5, atol=1e-8
        )
    with pytest.raises(ValueError, match="has no parameter 'colour'; it has: "):
        term.gradient_by("colour", x)


@pytest.mark.parametrize("term", [STIFFENING, FIBRES, SOFTENED], ids=lambda term: term.name)
def test_turning_the_tissue_turns_its_stress(term: MaterialTerm) -> None:
    F = POINTS.deformation(shaken())
    R = Rotation.from_rotvec([0.3, -1.1, 0.6]).as_matrix()
    density, stress = term.density_and_stress(F)
    turned_density, turned_stress = term.density_and_stress(R @ F)
    np.testing.assert_allclose(turned_density, density, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(turned_stress, R @ stress, rtol=1e-8, atol=1e-9)


@pytest.mark.parametrize("stretch", [0.7, 1.0, 1.4, 2.0])
def test_stiffening_of_an_incompressible_specimen_is_yeohs(stretch: float) -> None:
    """Nominal stress 2 (lambda - lambda^-2) 2 C20 (I1 - 3), with the pressure that keeps the sides
    free."""
    F = stretched(np.diag([stretch, stretch**-0.5, stretch**-0.5]))
    P = STIFFENING.density_and_stress(F)[1][0, 0]
    pressure = P[1, 1] * F[0, 0, 1, 1]
    nominal = P[0, 0] - pressure / stretch
    excess = stretch**2 + 2 / stretch - 3
    c20 = 0.7 * BODY.shear_pa[0, 0] / 2
    expected = 4 * c20 * excess * (stretch - stretch**-2)
    assert nominal == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_stiffening_leaves_pressure_alone_and_refuses_to_turn_inside_out() -> None:
    swollen = STIFFENING.density_and_stress(stretched(1.3 * np.eye(3)))
    np.testing.assert_allclose(swollen[0], 0, atol=1e-20)
    np.testing.assert_allclose(swollen[1], 0, atol=1e-10)
    assert np.all(np.isinf(STIFFENING.density_and_stress(stretched(np.diag([1.0, 1.0, -0.5])))[0]))


def test_fibres_carry_tension_along_themselves_only() -> None:
    along = np.array([np.cos(0.6), np.sin(0.6), 0.0])
    pulled = stretched(np.eye(3) + 1e-6 * np.outer(along, along))
    P = FIBRES.density_and_stress(pulled)[1][0, 0]
    np.testing.assert_allclose(
        P, 1e-6 * 2.0 * 3000.0 * np.outer(along, along), rtol=1e-4, atol=1e-8
    )
    pressed = stretched(np.eye(3) - 0.1 * np.outer(along, along))
    assert not np.any(FIBRES.density_and_stress(pressed)[1])
    assert not np.any(FIBRES.stress_tangent(pressed))


def test_softening_shows_on_the_way_back_only() -> None:
    F = stretched(np.diag([1.2, 0.95, 0.9]))
    W, P = density_and_stress((BODY,), F)
    first = Softened(POINTS, (BODY,), np.zeros_like(W), 0.4, 0.5)
    np.testing.assert_array_equal(first.density_and_stress(F)[1], P)
    np.testing.assert_array_equal(first.stress_tangent(F), BODY.stress_tangent(F))
    after = replace(first, largest_j_m3=1e9 * W)  # as good as all the way back
    np.testing.assert_allclose(after.density_and_stress(F)[1], (1 - 0.4 * 0.9953) * P, rtol=1e-4)


def test_softening_ahead_is_the_first_share_of_softening() -> None:
    x = shaken()
    ahead = SofteningAhead.of((BODY, STIFFENING), LARGEST, (0.2, 0.6))
    assert ahead.energy_and_gradient(x) == (0.0, pytest.approx(np.zeros_like(x)))
    ends = [replace(SOFTENED, share=share).energy_and_gradient(x)[1] for share in (0.0, 1e-6)]
    np.testing.assert_allclose(
        ahead.gradient_by("share_1", x), (ends[1] - ends[0]) / 1e-6, rtol=1e-4, atol=1e-9
    )


def test_a_step_of_memory_is_as_good_as_many() -> None:
    """Stress that rises evenly: the steps are exact however long they are."""
    tau, rise = 0.7, 3.0
    whole = Step(2.0 / tau).memory(np.zeros(1), np.array([rise * 2.0]))
    many = np.zeros(1)
    for _ in range(50):
        many = Step(0.04 / tau).memory(many, np.array([rise * 0.04]))
    np.testing.assert_allclose(many, whole, rtol=1e-12)
    np.testing.assert_allclose(whole, rise * tau * (1 - np.exp(-2.0 / tau)), rtol=1e-12)
    assert Step(0.0).arriving == 1.0
    assert Step(np.inf).memory(np.ones(1), np.ones(1)) == pytest.approx(0.0)


def test_what_fades_completely_leaves_the_rest_of_the_stress() -> None:
    x = shaken()
    F = POINTS.deformation(x)
    S = second_piola_pa(F, BODY.stress_pa(F))
    # Held for ever since: H is gone, and the present S is that of the last solve.
    fading = Fading.of(POINTS, (BODY,), 0.3, [(-0.5 * S, 0.5)])
    energy = PotentialEnergy(len(x), [BODY.scaled(1 - 0.3 * (1 - 0.5)), fading])
    np.testing.assert_allclose(
        energy.energy_and_gradient(x)[1], 0.7 * BODY.energy_and_gradient(x)[1], atol=1e-12
    )


def test_adhesion_takes_its_work_and_does_not_come_back() -> None:
    """Pulled straight off: the work is e s r a square metre; the second time next to nothing."""
    lift = np.array([0.0, 0.0, 1.0])
    area = SMALL.length_x_m * SMALL.width_y_m
    far_m = 20 * STUCK.reach_m
    work = STUCK.energy_and_gradient(MESH.nodes_m + far_m * lift)[0]
    assert work == pytest.approx(np.e * 80.0 * 0.0015 * area, rel=1e-6)
    at_reach = STUCK.energy_and_gradient(MESH.nodes_m + STUCK.reach_m * lift)[1].sum(axis=0)
    np.testing.assert_allclose(at_reach, 80.0 * area * lift, rtol=1e-9, atol=1e-12)
    torn = STUCK.with_farthest(np.full(STUCK.farthest_m.shape, far_m))
    again = torn.energy_and_gradient(MESH.nodes_m + STUCK.reach_m * lift)[1].sum(axis=0)
    assert abs(again[2]) < 1e-6 * at_reach[2]
    raised = STUCK.raised(0.002)
    np.testing.assert_allclose(
        raised.energy_and_gradient(MESH.nodes_m + 0.002 * lift)[1], 0, atol=1e-12
    )
