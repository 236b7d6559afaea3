import numpy as np
from scipy.spatial.transform import Rotation

from defras_sim.geometry import Pose
from defras_sim.tissue.path import Trail, between, length_m, markers_m


def moved(x: float, turn: float = 0.0) -> dict[str, Pose]:
    return {"psm1": Pose(np.array([x, 0.0, 0.0]), Rotation.from_rotvec([0, turn, 0]).as_matrix())}


def test_length_counts_translation_and_turns():
    assert np.isclose(length_m(moved(0.0), moved(0.01)), 0.01)
    assert np.isclose(length_m(moved(0.0), moved(0.0, 0.1)), 0.02 * 2 * np.sin(0.05))
    assert length_m({}, {}) == 0.0


def test_half_way_is_half_the_turn():
    middle = between(moved(0.0)["psm1"], moved(0.02, 0.6)["psm1"], 0.5)
    np.testing.assert_allclose(middle.position_m, [0.01, 0, 0])
    np.testing.assert_allclose(middle.rotation, moved(0.0, 0.3)["psm1"].rotation, atol=1e-12)


def trail_of(way, *places: float) -> Trail:
    trail = Trail()
    for x in places:
        trail.add(markers_m(moved(x)), np.full((2, 3), way(x)))
    return trail


def test_guesses_follow_a_parabola_exactly_even_with_uneven_steps():
    def way(x):
        return 3 * x**2 - 2 * x + 1

    guesses = trail_of(way, 0.0, 0.001, 0.0035).guesses(markers_m(moved(0.006)))
    np.testing.assert_allclose(guesses[-1], way(0.006))


def test_there_is_no_guess_around_corners_or_far_ahead():
    trail = trail_of(float, 0.0, 0.001)
    assert len(trail.guesses(markers_m(moved(0.002)))) == 1
    assert trail.guesses(markers_m(moved(-0.001))) == []
    assert trail.guesses(markers_m(moved(0.01))) == []
    trail.clear()
    assert trail.guesses(markers_m(moved(0.002))) == []


def test_a_tip_that_stays_replaces_its_equilibrium():
    trail = trail_of(float, 0.0, 0.001, 0.001, 0.001)
    assert len(trail.guesses(markers_m(moved(0.002)))) == 1
