import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from defras_sim.tissue import materials

NAMES = ["corotational", "neo_hookean", "stable_neo_hookean"]
E, NU = 3000.0, 0.45


def evaluate(name: str, F: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    mu, lam = materials.lame_parameters(name, E, NU)
    P, A = np.empty((3, 3)), np.empty((9, 9))
    density = materials.stress(materials.CODES[name], F, mu, lam, P)
    materials.tangent(materials.CODES[name], F, mu, lam, A)
    return density, P, A


def deformations() -> list[np.ndarray]:
    rng = np.random.default_rng(3)
    found = [np.eye(3), np.diag([1.4, 0.8, 0.9])]
    while len(found) < 12:
        F = Rotation.random(random_state=rng).as_matrix() @ (
            np.eye(3) + rng.normal(0, 0.25, (3, 3))
        )
        if np.linalg.det(F) > 0.2:
            found.append(F)
    return found


@pytest.mark.parametrize("name", NAMES)
def test_stress_is_the_slope_of_the_energy(name):
    for F in deformations():
        _, P, _ = evaluate(name, F)
        for index in np.ndindex(3, 3):
            step = np.zeros((3, 3))
            step[index] = 1e-6
            slope = (evaluate(name, F + step)[0] - evaluate(name, F - step)[0]) / 2e-6
            assert P[index] == pytest.approx(slope, abs=1e-3)


@pytest.mark.parametrize("name", NAMES)
def test_tangent_is_the_slope_of_the_stress_and_symmetric(name):
    for F in deformations():
        _, _, A = evaluate(name, F)
        np.testing.assert_allclose(A, A.T, rtol=1e-9, atol=1e-6)
        for index in np.ndindex(3, 3):
            step = np.zeros((3, 3))
            step[index] = 1e-6
            slope = (evaluate(name, F + step)[1] - evaluate(name, F - step)[1]) / 2e-6
            np.testing.assert_allclose(A[:, 3 * index[0] + index[1]], slope.ravel(), atol=0.02)


@pytest.mark.parametrize("name", NAMES)
def test_rotations_change_neither_energy_nor_more_than_the_direction_of_stress(name):
    R = Rotation.from_rotvec([0.4, -2.0, 1.0]).as_matrix()
    for F in deformations():
        density, P, _ = evaluate(name, F)
        turned, turned_P, _ = evaluate(name, R @ F)
        assert turned == pytest.approx(density, abs=1e-9)
        np.testing.assert_allclose(turned_P, R @ P, atol=1e-8)


@pytest.mark.parametrize("name", NAMES)
def test_small_strains_follow_hooke(name):
    _, P, A = evaluate(name, np.eye(3))
    np.testing.assert_allclose(P, 0, atol=1e-9)
    mu, lam = E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))
    one = np.eye(3)
    hooke = lam * np.einsum("iJ,kL->iJkL", one, one) + mu * (
        np.einsum("ik,JL->iJkL", one, one) + np.einsum("iL,Jk->iJkL", one, one)
    )
    np.testing.assert_allclose(A.reshape(3, 3, 3, 3), hooke, atol=1e-8)


def test_stable_neo_hookean_is_the_stress_of_bullet():
    # btDeformableNeoHookeanForce::firstPiola, from its published formula.
    mu, lam = materials.lame_parameters("stable_neo_hookean", E, NU)
    for F in deformations():
        trace, J = np.sum(F * F), np.linalg.det(F)
        cofactor = J * np.linalg.inv(F).T
        bullet = mu * (1 - 1 / (trace + 1)) * F + (lam * (J - 1) - 0.75 * mu) * cofactor
        np.testing.assert_allclose(evaluate("stable_neo_hookean", F)[1], bullet, atol=1e-9)


@pytest.mark.parametrize("name", ["corotational", "stable_neo_hookean"])
def test_inverted_points_have_finite_energy_and_a_consistent_slope(name):
    F = np.diag([1.1, 0.9, -0.2]) + 0.05
    density, P, _ = evaluate(name, F)
    assert np.isfinite(density)
    step = np.zeros((3, 3))
    step[2, 2] = 1e-6
    slope = (evaluate(name, F + step)[0] - evaluate(name, F - step)[0]) / 2e-6
    assert P[2, 2] == pytest.approx(slope, rel=1e-5)


def test_neo_hookean_cannot_be_inverted():
    assert evaluate("neo_hookean", np.diag([1.0, 1.0, -0.1]))[0] == np.inf
