"""The law of a dent against its own definition, solved by bisection and by differences."""

import numpy as np
import pytest
from scipy.optimize import brentq

from defras_sim.tissue.dent import Dent

GIVE, HARDENING = 0.03, 0.05
STIFFNESS = np.array([0.0, 5.0, 60.0, 1e4])


def law() -> Dent:
    return Dent(np.full(4, GIVE), np.full(4, HARDENING))


def stretch_of(pull_n: float, stiffness: float) -> float:
    return pull_n / stiffness + GIVE * pull_n / (1 + pull_n / HARDENING)


@pytest.mark.parametrize("stretch_m", [1e-9, 1e-5, 1e-3, 0.004, 0.05])
def test_the_pull_is_the_root_of_the_law(stretch_m):
    pulls = law().pull_n(STIFFNESS, np.full(4, stretch_m))
    assert pulls[0] == 0.0
    for pull, stiffness in zip(pulls[1:], STIFFNESS[1:], strict=True):
        root = brentq(
            lambda f, k=stiffness: stretch_of(f, k) - stretch_m, 0.0, 2e4 * stretch_m, xtol=1e-18
        )
        assert pull == pytest.approx(root, rel=1e-9)


def test_a_small_pull_meets_both_gives_in_series_and_a_large_one_the_spring_alone():
    slopes = law().slope_n_per_m(STIFFNESS, np.zeros(4))
    np.testing.assert_allclose(slopes[1:], 1 / (1 / STIFFNESS[1:] + GIVE))
    hard = law().slope_n_per_m(STIFFNESS, np.full(4, 1e4))
    np.testing.assert_allclose(hard, STIFFNESS, rtol=1e-6)


@pytest.mark.parametrize("stretch_m", [1e-4, 2e-3, 0.02])
def test_pull_and_slope_are_derivatives_of_the_energy(stretch_m):
    dent, step = law(), 1e-6 * stretch_m
    up, here, down = (np.full(4, stretch_m + s) for s in (step, 0.0, -step))
    pull = dent.pull_n(STIFFNESS, here)

    def energy(stretch: np.ndarray) -> np.ndarray:
        return dent.energy_j(STIFFNESS, stretch, dent.pull_n(STIFFNESS, stretch))

    np.testing.assert_allclose((energy(up) - energy(down)) / (2 * step), pull, rtol=1e-6)
    rise = (dent.pull_n(STIFFNESS, up) - dent.pull_n(STIFFNESS, down)) / (2 * step)
    np.testing.assert_allclose(dent.slope_n_per_m(STIFFNESS, pull), rise, rtol=1e-6)


def test_the_energy_is_that_of_the_spring_and_of_the_dent():
    dent, stretch = law(), np.full(4, 0.003)
    pull = dent.pull_n(STIFFNESS, stretch)
    spring = np.array([0.0, *(pull[1:] ** 2 / (2 * STIFFNESS[1:]))])
    whole = dent.energy_j(STIFFNESS, stretch, pull)
    np.testing.assert_allclose(whole - spring, dent.strain_energy_j(pull), atol=1e-15)


def test_tissue_without_dents_is_a_plain_spring():
    stretch = np.array([1e-3, 0.02, 0.5, 2.0])
    none = Dent.none(4)
    pull = none.pull_n(STIFFNESS, stretch)
    np.testing.assert_allclose(pull, STIFFNESS * stretch, rtol=1e-12)
    np.testing.assert_allclose(none.energy_j(STIFFNESS, stretch, pull), 0.5 * pull * stretch)
