"""Effects on what the tissue is made of."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from defras_sim.effects.extended_tissue import ExtendedTissue
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Attachments, Roi, Scene, Tissue
from tests.sim.effects.extended_motion import (
    ARM,
    FOLDED,
    GRASPED,
    HALFWAY,
    RAISED,
    extended,
    retract,
    scene,
)


def force_n(tissue: ExtendedTissue, pose: Pose, time_s: float) -> Floats:
    state = tissue.solve({ARM: pose}, time_s)
    assert state.converged
    return np.asarray(state.grasp_forces_n[ARM])


def size(force: Floats) -> float:
    return float(np.linalg.norm(force))


def test_a_stiffer_tissue_needs_more_force_for_the_same_shape() -> None:
    plain, stiffer = retract(extended({}), RAISED), retract(extended(STIFF), RAISED)
    ratio = size(stiffer.grasp_forces_n[ARM]) / size(plain.grasp_forces_n[ARM])
    assert ratio == pytest.approx(2.0, rel=0.01)  # holes and jaws are not quite rigid
    np.testing.assert_allclose(stiffer.nodes_m, plain.nodes_m, atol=1e-4)


STIFF = {"stiffness": {"scale": 2.0}}


def test_an_inclusion_of_everything_is_a_stiffer_tissue_with_the_dents_of_the_softer() -> None:
    wide = {"scale": 2.0, "radius_m": 0.4}
    all_of_it = retract(extended({"inclusion": wide}), RAISED)
    stiffer = extended(STIFF)
    stiffer.model.scale_dents(0.5)
    stiffer.model.grasp(ARM, GRASPED)
    state = stiffer.model.solve({ARM: RAISED})
    np.testing.assert_allclose(all_of_it.nodes_m, state.nodes_m, atol=1e-6)
    np.testing.assert_allclose(
        all_of_it.grasp_forces_n[ARM], state.grasp_forces_n[ARM], rtol=1e-5, atol=1e-6
    )


def test_an_inclusion_bends_less_where_it_is() -> None:
    disc = {"scale": 8.0, "x_m": 0.0, "y_m": 0.0, "radius_m": 0.018}
    stiff, plain = retract(extended({"inclusion": disc}), FOLDED), retract(extended({}), FOLDED)
    assert size(stiff.grasp_forces_n[ARM]) > 1.02 * size(plain.grasp_forces_n[ARM])
    moved = np.linalg.norm(stiff.nodes_m - plain.nodes_m, axis=1)
    assert moved.max() > 5e-4


def square() -> Scene:
    """Held all around, so that a quarter turn brings it onto itself."""
    rows = ("########", *("#......#",) * 6, "########")
    tissue = Tissue(length_x_m=0.08, width_y_m=0.08, elements_xyz=(4, 4, 1))
    roi = Roi(center_x_m=0.0, center_y_m=0.0, radius_m=0.01)
    return Scene(name="square", attachments=Attachments(map=rows), roi=roi, tissue=tissue)


def pulled(angle_rad: float, pull_m: tuple[float, float, float]) -> Floats:
    """Force (3,) of a pull at the middle of tissue with fibres at an angle."""
    fibres = {"anisotropy": {"strength": 4.0, "angle_rad": angle_rad}}
    tissue = ExtendedTissue(square(), fibres, residual_share=1e-7)
    tissue.grasp(ARM, Pose(np.zeros(3)))
    return force_n(tissue, Pose(np.array(pull_m)), 0.0)


def test_fibres_turned_with_the_pull_give_the_force_turned() -> None:
    along_x = pulled(0.0, (0.010, 0.0, 0.010))
    along_y = pulled(np.pi / 2, (0.0, 0.010, 0.010))
    turn = Rotation.from_rotvec([0.0, 0.0, np.pi / 2]).as_matrix()
    np.testing.assert_allclose(turn @ along_x, along_y, atol=1e-6)
    across = pulled(np.pi / 2, (0.010, 0.0, 0.010))
    assert along_x[0] > 1.3 * across[0]
    np.testing.assert_allclose(pulled(-np.pi, (0.010, 0.0, 0.010)), along_x, atol=1e-6)


def test_stiffening_shows_with_stretch() -> None:
    stiffening = {"strain_stiffening": {"coefficient": 3.0}}
    ratios = []
    for far_m in (0.0005, 0.012):
        forces = []
        for extension in ({}, stiffening):
            tissue = ExtendedTissue(square(), extension, residual_share=1e-7)
            tissue.grasp(ARM, Pose(np.zeros(3)))
            forces.append(size(force_n(tissue, Pose(np.array([far_m, 0.0, 0.0])), 0.0)))
        ratios.append(forces[1] / forces[0])
    assert ratios[0] == pytest.approx(1.0, abs=0.01)
    assert ratios[1] > 1.1


@pytest.mark.parametrize("scale", [0.8, 1.25])
def test_another_thickness_is_about_a_scene_of_that_thickness(scale: float) -> None:
    """Not quite: dents stay as they were."""
    effect = retract(extended({"thickness": {"scale": scale}}), HALFWAY, RAISED)
    other = retract(extended({}, thickness_m=scale * 0.005), HALFWAY, RAISED)
    plain = retract(extended({}), HALFWAY, RAISED)
    change = size(other.grasp_forces_n[ARM]) - size(plain.grasp_forces_n[ARM])
    found = size(effect.grasp_forces_n[ARM]) - size(plain.grasp_forces_n[ARM])
    assert found == pytest.approx(change, rel=0.15)
    apart = np.linalg.norm(effect.surface.vertices_m - other.surface.vertices_m, axis=1)
    assert np.median(apart) < 3e-4


RELAXING = {"stress_relaxation": {"fraction": 0.4, "time_s": 2.0}}


def relaxed_forces(step_s: float, times_s: Floats) -> Floats:
    """Sizes of the force while the tissue is held, raised at once at time 0."""
    tissue = extended(RELAXING)
    retract(tissue, HALFWAY, RAISED, step_s=0.0)
    forces, time_s = [], 0.0
    for wanted in times_s:
        while time_s < wanted - 1e-9:
            time_s = min(time_s + step_s, float(wanted))
            now = force_n(tissue, RAISED, time_s)
        forces.append(size(now))
    return np.array(forces)


def test_a_held_force_fades_to_its_share_with_its_time_whatever_the_step() -> None:
    at_once = retract(extended({}), HALFWAY, RAISED).grasp_forces_n[ARM]
    tissue = extended(RELAXING)
    unrelaxed = retract(tissue, HALFWAY, RAISED, step_s=0.0).grasp_forces_n[ARM]
    np.testing.assert_allclose(unrelaxed, at_once, atol=1e-5)
    times_s = np.array([0.5, 2.0, 5.0, 20.0])
    expected = size(at_once) * (1 - 0.4 * (1 - np.exp(-times_s / 2.0)))
    for step_s in (0.25, 20.0):
        np.testing.assert_allclose(relaxed_forces(step_s, times_s), expected, rtol=5e-3)


def test_tissue_let_go_creeps_back_to_rest() -> None:
    tissue = extended(RELAXING)
    rest_m = tissue.solve({}, 0.0).nodes_m
    retract(tissue, HALFWAY, FOLDED)
    tissue.solve({ARM: FOLDED}, 10.0)
    tissue.release(ARM)
    away = [np.abs(tissue.solve({}, t).nodes_m - rest_m).max() for t in (10.0, 12.0, 40.0)]
    assert away[0] > 1e-3
    assert away[1] < 0.7 * away[0]
    assert away[2] < 0.1 * away[0]


def test_fast_and_slow_pulls_differ_by_what_fades() -> None:
    fast = retract(extended(RELAXING), HALFWAY, RAISED, step_s=0.01).grasp_forces_n[ARM]
    slow = retract(extended(RELAXING), HALFWAY, RAISED, step_s=1e4).grasp_forces_n[ARM]
    assert size(slow) == pytest.approx(0.6 * size(fast), rel=0.01)


def test_time_that_runs_backwards_is_refused() -> None:
    tissue = extended(RELAXING)
    retract(tissue, HALFWAY)
    with pytest.raises(ValueError, match=r"world time went back from 1 s to 0.5 s"):
        tissue.solve({ARM: HALFWAY}, 0.5)


SOFTENING = {"softening": {"share": 0.5, "width": 0.5}}


def test_the_first_pull_is_the_plain_one_and_the_second_weaker_up_to_where_it_was() -> None:
    tissue, plain = extended(SOFTENING), extended({})
    farther = Pose(RAISED.position_m + [0.0, 0.0, 0.006], RAISED.rotation)
    first = [retract(tissue, HALFWAY).grasp_forces_n[ARM], force_n(tissue, RAISED, 2.0)]
    expected = [retract(plain, HALFWAY).grasp_forces_n[ARM], force_n(plain, RAISED, 2.0)]
    np.testing.assert_allclose(first, expected, atol=0.02 * size(expected[1]))
    force_n(tissue, GRASPED, 3.0)
    again = size(force_n(tissue, HALFWAY, 4.0))
    assert again < 0.8 * size(expected[0])
    assert size(force_n(tissue, RAISED, 5.0)) == pytest.approx(size(expected[1]), rel=0.02)
    beyond = size(force_n(tissue, farther, 6.0))
    assert beyond == pytest.approx(size(force_n(plain, farther, 6.0)), rel=0.02)


@pytest.mark.parametrize("name", ["softening", "stress_relaxation", "bed_adhesion"])
def test_history_can_be_taken_back_and_repeated(name: str) -> None:
    values = {
        "softening": SOFTENING["softening"],
        "stress_relaxation": RELAXING["stress_relaxation"],
        "bed_adhesion": {"strength_pa": 40.0},
    }[name]
    tissue = extended({name: values})
    retract(tissue, RAISED)
    kept = tissue.snapshot()
    ends = []
    for _ in range(2):
        tissue.solve({ARM: FOLDED}, 2.0)
        ends.append(tissue.solve({ARM: HALFWAY}, 3.0).grasp_forces_n[ARM])
        tissue.restore(kept)
    np.testing.assert_allclose(ends[0], ends[1], atol=2e-6)


def test_effects_of_the_material_go_together() -> None:
    """What has softened fades, and what fades stiffens: no order of calls matters."""
    together = {**RELAXING, **SOFTENING, "strain_stiffening": {"coefficient": 0.5}}
    reverse = dict(reversed(together.items()))
    motion = (RAISED, HALFWAY, RAISED)
    one, other = (retract(extended(each), *motion) for each in (together, reverse))
    np.testing.assert_array_equal(one.nodes_m, other.nodes_m)
    for left_out in together:
        rest = {name: values for name, values in together.items() if name != left_out}
        without = retract(extended(rest), *motion[:2])
        with_it = retract(extended(together), *motion[:2])
        change = with_it.grasp_forces_n[ARM] - without.grasp_forces_n[ARM]
        assert size(change) > 1e-3 * size(without.grasp_forces_n[ARM]), left_out


def test_relaxation_under_weight_starts_at_rest() -> None:
    tissue = ExtendedTissue(scene(gravity_m_s2=4.0), RELAXING)
    lying = tissue.solve({}, 0.0)
    assert lying.converged
    later = tissue.solve({}, 30.0)
    np.testing.assert_allclose(later.nodes_m, lying.nodes_m, atol=2e-5)
