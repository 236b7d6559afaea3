"""Effects on tissue are nothing at their null values, and their directions are derivatives."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from defras_sim.effects import library
from defras_sim.effects.extended_tissue import ExtendedTissue
from defras_sim.effects.tissue_effect import Direction, TissueEffect
from defras_sim.geometry import Floats
from defras_sim.tissue.state import TissueState
from tests.sim.effects.extended_motion import (
    ARM,
    FOLDED,
    GRASPED,
    HALFWAY,
    RAISED,
    extended,
    retract,
)

EFFECTS = {e.name: e for e in library.effects("tissue") if isinstance(e, TissueEffect)}
PATCH = {"x_m": -0.002, "y_m": 0.015, "radius_m": 0.015}
FREE = {"x_m": 0.01, "y_m": -0.02, "radius_m": 0.012}
PRESENT = {
    "anisotropy": {"strength": 2.0, "angle_rad": 0.5},
    "attachment_compliance": {"compliance_m_per_n": 0.02},
    "attachment_tear": {"share": 0.6, "time_s": 1.5, **PATCH},
    "breathing": {"amplitude_m": 0.002, "period_s": 5.0, "phase_rad": 0.3},
    "extra_attachment": {"share": 0.4, **FREE},
    "inclusion": {"scale": 3.0, **PATCH},
    "missing_attachment": {"share": 0.6, **PATCH},
    "stiffness": {"scale": 1.7},
    "strain_stiffening": {"coefficient": 1.0},
    "thickness": {"scale": 1.2},
}
"""Effects with exact derivatives where they are present, and values of theirs."""
ABSENT = {
    **PRESENT,
    "bed_adhesion": {"reach_m": 0.002},
    "softening": {"width": 0.5},
    "stress_relaxation": {"time_s": 2.0},
}
"""Effects with exact derivatives where they are absent."""


DISCS = {"attachment_tear", "extra_attachment", "inclusion", "missing_attachment"}


@pytest.fixture(scope="module")
def plain() -> TissueState:
    return retract(extended({}), HALFWAY, RAISED, FOLDED)


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_at_its_null_values_is_nothing(name: str, plain: TissueState) -> None:
    state = retract(extended({name: {}}), HALFWAY, RAISED, FOLDED)
    np.testing.assert_array_equal(state.nodes_m, plain.nodes_m)
    np.testing.assert_array_equal(state.grasp_forces_n[ARM], plain.grasp_forces_n[ARM])
    assert state.largest_principal_stress_pa == plain.largest_principal_stress_pa


@pytest.mark.parametrize("name", EFFECTS)
def test_at_the_bounds_of_their_strengths_effects_end_finite(name: str) -> None:
    """In equilibrium, or in a stale state that says so."""
    strengths = {p.name: p.upper for p in EFFECTS[name].parameters if p.strength}
    tissue = extended({name: {**strengths, "radius_m": 0.03} if name in DISCS else strengths})
    tissue.solve({}, 0.0)
    tissue.grasp(ARM, GRASPED)
    for time_s, pose in ((0.2, HALFWAY), (0.5, RAISED), (0.8, GRASPED)):
        state = tissue.solve({ARM: pose}, time_s)
        assert np.isfinite(state.nodes_m).all()
        assert np.isfinite(state.grasp_forces_n[ARM]).all()


def test_all_effects_together_find_an_equilibrium() -> None:
    everything = {
        **PRESENT,
        "bed_adhesion": {"strength_pa": 30.0},
        "gravity": {"acceleration_m_s2": 3.0},
        "softening": {"share": 0.3},
        "stress_relaxation": {"fraction": 0.3},
    }
    assert everything.keys() == EFFECTS.keys()
    tissue = extended(everything)
    state = retract(tissue, HALFWAY, RAISED, HALFWAY)
    assert state.converged
    net_n = sum(wrench.force_n for wrench in state.wrenches.values())
    np.testing.assert_allclose(net_n, 0, atol=1e-4)
    again = tissue.solve({ARM: HALFWAY}, 3.0)
    np.testing.assert_allclose(again.nodes_m, state.nodes_m, atol=1e-4)


def moved(name: str, values: Mapping[str, float]) -> ExtendedTissue:
    tissue = extended({name: values}, residual_share=1e-11)
    retract(tissue, HALFWAY, FOLDED, RAISED)
    return tissue


def numbers(tissue: ExtendedTissue) -> Floats:
    """Positions [m] and, in units of 10 N, forces at the last equilibrium."""
    state = tissue.model.solve({ARM: RAISED})
    forces = [state.grasp_forces_n[ARM], state.attachment_forces_n.ravel()]
    return np.concatenate([state.surface.vertices_m.ravel(), 0.1 * np.concatenate(forces)])


def derivative(tissue: ExtendedTissue, direction: Direction) -> Floats:
    by = tissue.model.sensitivities(list(direction.by))
    each = np.concatenate(
        [
            by.surface_by.reshape(-1, by.surface_by.shape[-1]),
            0.1 * by.grasp_forces_by[ARM],
            0.1 * by.attachment_forces_by.reshape(-1, by.surface_by.shape[-1]),
        ]
    )
    change = np.zeros(len(each))
    for parameter, factor in direction.by.items():
        change += factor * each[:, by.columns[parameter].start]
    return change


def step_of(name: str, parameter: str) -> float:
    return 2e-5 * next(p.step for p in EFFECTS[name].parameters if p.name == parameter)


@pytest.mark.parametrize("name", PRESENT)
def test_directions_of_a_present_effect_are_derivatives(name: str) -> None:
    values = PRESENT[name]
    tissue = moved(name, values)
    directions = tissue.directions(name)
    assert directions
    for direction in directions[-1:]:
        step = step_of(name, direction.parameter)
        there, back = (
            numbers(moved(name, {**values, direction.parameter: values[direction.parameter] + s}))
            for s in (step, -step)
        )
        expected = (there - back) / (2 * step)
        error = np.linalg.norm(derivative(tissue, direction) - expected)
        assert error < 2e-4 * np.linalg.norm(expected), direction.parameter


@pytest.mark.parametrize("name", ABSENT)
def test_directions_of_an_absent_effect_are_one_sided_derivatives(name: str) -> None:
    tissue = moved(name, {k: v for k, v in ABSENT[name].items() if not strength(name, k)})
    directions = tissue.directions(name)
    assert directions
    before = numbers(tissue)
    shown = [np.linalg.norm(derivative(tissue, d)) for d in directions]
    direction = directions[int(np.argmax(shown))]
    null = next(p.null for p in EFFECTS[name].parameters if p.name == direction.parameter)
    step = step_of(name, direction.parameter)
    half, whole = (
        numbers(moved(name, {**ABSENT[name], **direction.at, direction.parameter: null + s}))
        - before
        for s in (step / 2, step)
    )
    expected = (4 * half - whole) / step
    error = np.linalg.norm(derivative(tissue, direction) - expected)
    assert error < 2e-4 * np.linalg.norm(expected), direction


def strength(name: str, parameter: str) -> bool:
    return next(p.strength for p in EFFECTS[name].parameters if p.name == parameter)
