"""The way of a similar model: what it says between its instants, and what it saves."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from defras_sim.known_way import KnownWay
from defras_sim.prediction import Prediction, predict
from tests.sim.test_prediction import END_S, RELEASE_S, motion, predicted, scene

NODES_M = np.array([[[0.0, 0.0, 0.0]], [[0.0, 0.0, 0.01]], [[0.02, 0.0, 0.01]]])
WAY = KnownWay(np.array([1.0, 2.0, 4.0]), NODES_M)


def test_between_equilibria_nodes_go_straight_on() -> None:
    assert np.allclose(WAY.change_m(1.0, 1.5), [[0.0, 0.0, 0.005]])
    assert np.allclose(WAY.change_m(1.5, 3.0), [[0.01, 0.0, 0.005]])
    assert np.allclose(WAY.change_m(4.0, 1.0), [[-0.02, 0.0, -0.01]])


def test_before_the_first_and_after_the_last_nothing_moves() -> None:
    assert np.allclose(WAY.change_m(0.0, 1.0), 0.0)
    assert np.allclose(WAY.change_m(4.0, 9.0), 0.0)
    assert np.allclose(KnownWay(np.array([1.0]), NODES_M[:1]).change_m(0.0, 5.0), 0.0)


def test_nodes_in_between_go_as_their_neighbours_do() -> None:
    middle = sparse.csr_array(np.array([[0.5, 0.5]]))
    two = KnownWay(np.array([0.0, 1.0]), np.array([np.zeros((2, 3)), [[0, 0, 1], [0, 0, 3]]]))
    assert np.allclose(two.between_nodes(middle).change_m(0.0, 1.0), [[0.0, 0.0, 2.0]])


def guided(
    like: KnownWay | None, *effects: tuple[str, tuple[tuple[str, float], ...]]
) -> Prediction:
    extension = {name: dict(values) for name, values in effects}
    return predict(scene().extended(extension), motion(), like=like)


@pytest.mark.parametrize(
    "effect",
    [
        ("stiffness", (("scale", 1.4),)),
        ("tool_offset", (("x_m", 0.003), ("z_m", 0.002))),
        ("attachment_compliance", (("compliance_m_per_n", 0.05),)),
        ("stress_relaxation", (("fraction", 0.4), ("time_s", 1.0))),
    ],
)
def test_a_guided_model_finds_the_same_equilibria(
    effect: tuple[str, tuple[tuple[str, float], ...]],
) -> None:
    alone, led = predicted(effect), guided(predicted().way, effect)
    held = alone.time_s < RELEASE_S - 1e-6  # let go, it comes to rest wherever little pushes it
    assert np.allclose(led.vertices_m[held], alone.vertices_m[held], rtol=0, atol=5e-5)
    assert np.allclose(led.vertices_m, alone.vertices_m, rtol=0, atol=1e-3)
    assert np.allclose(led.force_n("psm1"), alone.force_n("psm1"), rtol=0, atol=1e-3)


def test_the_way_of_the_model_itself_saves_most_of_the_work() -> None:
    alone = predicted()
    led = guided(alone.way)
    spent, saved = (sum(s.iterations for s in p.states) for p in (alone, led))
    assert saved < 0.5 * spent


def test_a_way_that_leads_astray_costs_work_and_changes_nothing() -> None:
    rng = np.random.default_rng(0)
    known = predicted().way
    assert known is not None
    wrong = KnownWay(known.time_s, rng.normal(0.0, 0.01, known.nodes_m.shape))
    led = guided(wrong)
    assert np.allclose(led.vertices_m, predicted().vertices_m, rtol=0, atol=1e-4)
    assert led.time_s[-1] == pytest.approx(END_S)
