import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from defras_sim.tissue import collapsed, materials

CODE = materials.CODES["corotational"]


def made_of(sigma, seed=0) -> np.ndarray:
    left, right = Rotation.random(2, random_state=seed).as_matrix()
    return left @ np.diag(sigma) @ right.T


def energy_and_stress(F):
    P = np.empty((3, 3))
    return materials.stress(CODE, np.ascontiguousarray(F), 1000.0, 9000.0, P), P


STRETCHES = [
    (3.4, 0.6, -0.55), (3.4, 0.5, -0.4999), (3.4, 0.5, -0.5), (2.5, 0.05, 0.02), (2.5, 0.4, -0.2),
    (1.5, 0.9, -0.89), (2.0, 0.03, 0.0),
]  # fmt: skip


@pytest.mark.parametrize("sigma", STRETCHES)
def test_stress_and_tangent_are_slopes_across_the_edge(sigma):
    F = made_of(sigma)
    rng = np.random.default_rng(0)
    A = np.empty((9, 9))
    materials.tangent(CODE, F, 1000.0, 9000.0, A)
    np.testing.assert_allclose(A, A.T, atol=1e-6 * np.abs(A).max())
    _, P = energy_and_stress(F)
    for _ in range(5):
        way = rng.normal(size=(3, 3))
        (up, up_P), (down, down_P) = (energy_and_stress(F + s * 1e-6 * way) for s in (1, -1))
        assert np.sum(P * way) == pytest.approx((up - down) / 2e-6, abs=2e-3)
        expected = (up_P - down_P).ravel() / 2e-6
        np.testing.assert_allclose(A @ way.ravel(), expected, atol=2e-4 * np.abs(A).max())


def test_away_from_the_edge_it_is_the_material_itself():
    """Where both ways of computing apply they agree, inside out or not."""
    for sigma in ((2.6, 0.55, -0.2), (3.0, 0.4, 0.001), (1.2, 0.3, -0.15)):
        F = made_of(sigma, 3)
        assert collapsed.is_near(F)
        P = np.empty((3, 3))
        value = collapsed.stress(F, 1000.0, 9000.0, P)
        trace = sum(sigma)
        expected = 1000.0 * sum((s - 1) ** 2 for s in sigma) + 4500.0 * (trace - 3) ** 2
        assert value == pytest.approx(expected, rel=1e-9)


def test_every_state_in_the_rounded_edge_is_found():
    rng = np.random.default_rng(0)
    for seed in range(300):
        small = rng.uniform(0, 0.8)
        sigma = (
            rng.uniform(small, 4),
            small,
            rng.uniform(-small, min(small, collapsed.WIDTH - small)),
        )
        if sigma[1] + sigma[2] < collapsed.WIDTH:
            assert collapsed.is_near(made_of(sigma, seed))
