import numpy as np
import pytest
from scipy import sparse

from defras_sim.geometry import Pose
from defras_sim.tissue.solver import NewtonSettings, NewtonSolver
from defras_sim.tissue.travel import MAX_TIP_STEP_M, Traveller


class Follower:
    """Two nodes on springs of 1 N/m: they are in equilibrium where the tip is.

    Beyond ``end_m`` there is no equilibrium: the energy is infinite.
    """

    def __init__(self, end_m: float = np.inf) -> None:
        self.end_m = end_m
        self.asked_m: list[float] = []

    def at(self, tips) -> "Follower":
        self.tip_m = tips["psm1"].position_m
        self.asked_m.append(self.tip_m[0])
        return self

    def energy_and_gradient(self, positions_m):
        if self.tip_m[0] > self.end_m:
            return np.inf, np.full_like(positions_m, np.nan)
        away_m = positions_m - self.tip_m
        return 0.5 * float(np.sum(away_m**2)), away_m

    def tangent(self, positions_m):
        return sparse.csc_array(sparse.eye_array(positions_m.size, format="csc"))


def tip(x_m: float) -> dict[str, Pose]:
    return {"psm1": Pose(np.array([x_m, 0.0, 0.0]))}


def go(follower: Follower, end_m: float):
    traveller = Traveller(NewtonSolver(NewtonSettings(1e-9)), follower.at)
    return traveller.go(np.zeros((2, 3)), tip(0.0), tip(end_m))


def test_a_long_way_is_gone_in_short_steps():
    follower = Follower()
    arrival = go(follower, 0.03)
    assert arrival.arrived
    np.testing.assert_allclose(arrival.positions_m, [[0.03, 0, 0]] * 2)
    np.testing.assert_allclose(arrival.tips["psm1"].position_m, [0.03, 0, 0])
    assert follower.asked_m[0] <= MAX_TIP_STEP_M


def test_a_way_that_ends_early_says_how_far_it_went():
    follower = Follower(end_m=0.0101)
    arrival = go(follower, 0.03)
    assert not arrival.arrived
    reached_m = arrival.tips["psm1"].position_m[0]
    assert 0.0095 < reached_m <= 0.0101
    np.testing.assert_allclose(arrival.positions_m[:, 0], reached_m)


def test_work_on_a_hopeless_way_is_bounded():
    follower = Follower(end_m=0.0)
    arrival = go(follower, 5.0)
    assert not arrival.arrived
    assert arrival.iterations < 20
    assert len(follower.asked_m) < 20


@pytest.mark.parametrize("end_m", [0.0, 0.001])
def test_a_short_way_is_one_step(end_m):
    follower = Follower()
    assert go(follower, end_m).arrived
    assert follower.asked_m == [end_m]
