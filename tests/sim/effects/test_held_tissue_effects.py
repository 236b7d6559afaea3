"""Effects on what holds the tissue: attachments and the bed."""

from __future__ import annotations

import numpy as np
import pytest

from defras_sim.effects.extended_tissue import ExtendedTissue
from defras_sim.effects.holding import (
    TISSUE_N_PER_M,
    strengthened_by,
    strengthened_n_per_m,
    weakened_by,
    weakened_n_per_m,
)
from defras_sim.geometry import Pose
from defras_sim.scene import RIGID_HOLE_N_PER_M, Attachments, Scene
from tests.sim.effects.extended_motion import (
    ARM,
    GRASPED,
    HALFWAY,
    RAISED,
    extended,
    retract,
    scene,
)


def with_hole(marked: Scene, number: int, mark: str) -> Scene:
    """The scene with one hole, in the order of ``holes_xy_m``, marked otherwise."""
    columns, _ = marked.hole_counts
    rows = [list(row) for row in reversed(marked.attachments.map)]
    rows[number // columns][number % columns] = mark
    drawn = tuple("".join(row) for row in reversed(rows))
    return marked.model_copy(update={"attachments": Attachments(map=drawn)})


def force_n(tissue: ExtendedTissue, *poses: Pose, step_s: float = 1.0) -> float:
    return float(np.linalg.norm(retract(tissue, *poses, step_s=step_s).grasp_forces_n[ARM]))


@pytest.mark.parametrize(
    ("name", "strength", "hole", "mark"),
    [
        ("extra_attachment", {"share": 1.0}, 21, "#"),
        ("missing_attachment", {"share": 1.0}, 35, "."),
        ("attachment_tear", {"share": 1.0}, 35, "."),
    ],
)
def test_a_disc_over_one_hole_is_a_scene_with_that_hole_marked_otherwise(
    name: str, strength: dict[str, float], hole: int, mark: str
) -> None:
    believed = scene()
    x_m, y_m = believed.holes_xy_m[hole].tolist()
    actual = with_hole(believed, hole, mark)
    assert not np.array_equal(actual.attached, believed.attached)
    other = retract(ExtendedTissue(actual, {}), HALFWAY, RAISED)
    disc = {"x_m": x_m, "y_m": y_m, "radius_m": 0.005}
    effect = retract(ExtendedTissue(believed, {name: {**strength, **disc}}), HALFWAY, RAISED)
    np.testing.assert_allclose(effect.nodes_m, other.nodes_m, atol=2e-5)
    np.testing.assert_allclose(effect.grasp_forces_n[ARM], other.grasp_forces_n[ARM], atol=1e-5)


def test_compliant_attachments_are_those_of_a_scene_that_says_so() -> None:
    give = 0.03
    softer = Attachments(
        map=scene().attachments.map, stiffness_n_per_m=1 / (1 / RIGID_HOLE_N_PER_M + give)
    )
    actual = scene().model_copy(update={"attachments": softer})
    other = retract(ExtendedTissue(actual, {}), HALFWAY, RAISED)
    effect = retract(extended({"attachment_compliance": {"compliance_m_per_n": give}}), RAISED)
    np.testing.assert_allclose(effect.grasp_forces_n[ARM], other.grasp_forces_n[ARM], atol=2e-5)


def test_the_hold_that_tissue_feels_is_shared_out_evenly() -> None:
    stiffness = np.array([0.0, 10.0, 40.0, RIGID_HOLE_N_PER_M])
    lost = np.full(4, 0.25)
    left = weakened_n_per_m(stiffness, lost)
    np.testing.assert_allclose(
        left / (left + TISSUE_N_PER_M), 0.75 * stiffness / (stiffness + TISSUE_N_PER_M)
    )
    np.testing.assert_array_equal(weakened_n_per_m(stiffness, np.zeros(4)), stiffness)
    np.testing.assert_array_equal(weakened_n_per_m(stiffness, np.ones(4)), 0.0)
    step = 1e-6
    slope = (weakened_n_per_m(stiffness, lost + step) - left) / step
    np.testing.assert_allclose(weakened_by(stiffness, lost), slope, rtol=1e-4)


def test_a_hold_gained_is_a_share_of_what_a_rigid_hole_has_more() -> None:
    stiffness = np.array([0.0, 10.0, 40.0, RIGID_HOLE_N_PER_M])
    rigid = RIGID_HOLE_N_PER_M / (RIGID_HOLE_N_PER_M + TISSUE_N_PER_M)
    hold = stiffness / (stiffness + TISSUE_N_PER_M)
    gained = np.full(4, 0.25)
    more = strengthened_n_per_m(stiffness, gained)
    np.testing.assert_allclose(more / (more + TISSUE_N_PER_M), 0.75 * hold + 0.25 * rigid)
    np.testing.assert_array_equal(strengthened_n_per_m(stiffness, np.zeros(4)), stiffness)
    np.testing.assert_allclose(strengthened_n_per_m(stiffness, np.ones(4)), RIGID_HOLE_N_PER_M)
    step = 1e-6
    slope = (strengthened_n_per_m(stiffness, gained + step) - more) / step
    np.testing.assert_allclose(strengthened_by(stiffness, gained), slope, rtol=1e-4)


PATCH = {"x_m": -0.035, "y_m": 0.015, "radius_m": 0.02, "share": 1.0}


def test_what_tears_in_time_stays_torn() -> None:
    tissue, plain = extended({"attachment_tear": {**PATCH, "time_s": 1.5}}), extended({})
    before, whole = retract(tissue, RAISED), retract(plain, RAISED)
    np.testing.assert_array_equal(before.nodes_m, whole.nodes_m)
    assert not tissue.is_due(1.4)
    assert tissue.is_due(1.6)
    torn = tissue.solve({ARM: RAISED}, 1.6)
    assert not tissue.is_due(1.7)
    held = np.hypot(*(scene().holes_xy_m - [PATCH["x_m"], PATCH["y_m"]]).T) < 0.014
    assert np.all(torn.attachment_forces_n[held] == 0.0)
    assert np.any(whole.attachment_forces_n[held] != 0.0)
    # What is believed about holes may change; what has torn does not hold for that.
    tissue.set_hole_stiffness(np.full(64, RIGID_HOLE_N_PER_M))
    assert np.all(tissue.model.hole_stiffness_n_per_m[held] == 0.0)


def test_overloaded_attachments_tear_one_after_the_other_and_for_good() -> None:
    most_n = 0.01
    everywhere = {"x_m": 0.0, "y_m": 0.0, "radius_m": 0.2, "share": 1.0}
    tissue = extended({"attachment_tear": {**everywhere, "force_n": most_n}})
    raised = retract(tissue, HALFWAY, RAISED)
    carried = np.linalg.norm(raised.attachment_forces_n, axis=1)
    assert 0 < carried.max() < most_n
    stiffness = tissue.model.hole_stiffness_n_per_m
    torn = scene().attached & (stiffness == 0)
    assert torn.sum() > 0
    tissue.solve({ARM: GRASPED}, 5.0)
    np.testing.assert_array_equal(tissue.model.hole_stiffness_n_per_m, stiffness)
    plain = retract(extended({}), HALFWAY, RAISED)
    assert np.linalg.norm(plain.attachment_forces_n, axis=1).max() > most_n


def test_a_second_lift_off_a_sticky_bed_is_easier_until_it_goes_farther() -> None:
    sticky = {"strength_pa": 60.0, "reach_m": 0.001}
    tissue, plain = extended({"bed_adhesion": sticky}), extended({})
    lifts = [HALFWAY, RAISED, GRASPED, HALFWAY, RAISED]
    half, whole, _, half_again, whole_again = forces_n(tissue, *lifts)
    half_free, whole_free = forces_n(plain, HALFWAY, RAISED)
    assert half > 1.3 * half_free
    assert half_again < half - 0.4 * (half - half_free)
    assert whole > 1.1 * whole_free
    assert whole_again == pytest.approx(whole, rel=1e-3)
    weaker = forces_n(extended({"bed_adhesion": {**sticky, "strength_pa": 30.0}}), HALFWAY)
    assert half_free < weaker[0] < half


def forces_n(tissue: ExtendedTissue, *poses: Pose) -> list[float]:
    """Sizes of the force at the poses, one a second."""
    first = force_n(tissue, poses[0])
    states = [tissue.solve({ARM: pose}, 2.0 + n) for n, pose in enumerate(poses[1:])]
    assert all(state.converged for state in states)
    return [first, *(float(np.linalg.norm(s.grasp_forces_n[ARM])) for s in states)]


def test_untouched_tissue_rides_on_what_breathes() -> None:
    breath = {"amplitude_m": 0.004, "period_s": 4.0, "phase_rad": 0.5}
    tissue = extended({"breathing": breath})
    rest_m = tissue.solve({}, 0.0).nodes_m - [0, 0, 0.004 * np.sin(0.5)]
    for time_s in (0.3, 1.0, 2.2, 3.0, 4.0):
        assert tissue.is_due(time_s)
        height = 0.004 * np.sin(2 * np.pi * time_s / 4.0 + 0.5)
        state = tissue.solve({}, time_s)
        assert state.converged
        np.testing.assert_allclose(state.nodes_m, rest_m + [0, 0, height], atol=3e-5)
    assert not tissue.is_due(4.0)


def test_a_held_patch_feels_every_breath_alike() -> None:
    tissue = extended({"breathing": {"amplitude_m": 0.003, "period_s": 2.0}})
    forces = [retract(tissue, HALFWAY, RAISED).grasp_forces_n[ARM]]
    forces += [tissue.solve({ARM: RAISED}, t).grasp_forces_n[ARM] for t in (2.5, 3.5, 4.0, 4.5)]
    np.testing.assert_allclose(forces[3], forces[0], atol=5e-5)
    np.testing.assert_allclose(forces[4], forces[1], atol=5e-5)
    assert np.linalg.norm(forces[2] - forces[1]) > 0.005


def test_heavier_tissue_hangs_on_the_jaw_and_lies_unstressed() -> None:
    tissue = extended({"gravity": {"acceleration_m_s2": 9.81}})
    lying = tissue.solve({}, 0.0)
    weight_n = 1000.0 * 9.81 * 0.08 * 0.08 * 0.005
    assert np.abs(lying.attachment_forces_n).max() < 1e-5
    assert lying.bed_force_n[2] == pytest.approx(weight_n, rel=1e-3)
    raised = retract(tissue, HALFWAY, RAISED)
    up = raised.grasp_forces_n[ARM] + raised.attachment_forces_n.sum(axis=0) + raised.bed_force_n
    np.testing.assert_allclose(up, [0, 0, weight_n], atol=1e-4)
    heavier = np.linalg.norm(raised.grasp_forces_n[ARM])
    assert heavier > force_n(extended({}), HALFWAY, RAISED) + 0.05


def test_what_no_tissue_can_be_is_refused_in_words() -> None:
    with pytest.raises(ValueError, match="make the scene's 0 m"):
        extended({"gravity": {"acceleration_m_s2": -3.0}})
    with pytest.raises(ValueError, match="tissue without a bed has nothing to lie on"):
        extended({"gravity": {"acceleration_m_s2": 3.0}}, bed=False)
    with pytest.raises(ValueError, match="missing_attachment: share should be between 0 and 1"):
        extended({"missing_attachment": {"share": 1.5}})
