"""Rows come in order of time, and later ones give way to what is told again."""

from __future__ import annotations

import numpy as np

from defras_sim.effects.history import History


def test_it_keeps_everything_and_grows() -> None:
    history = History(2)
    for row in range(500):
        history.add(0.1 * row, np.array([row, -row]))
    assert len(history) == 500
    assert np.array_equal(history.values[:, 0], np.arange(500))
    assert np.allclose(history.time_s, 0.1 * np.arange(500))


def test_what_is_told_again_takes_the_place_of_all_that_came_later() -> None:
    history = History(1)
    for time_s, value in ((0.0, 1.0), (1.0, 2.0), (2.0, 3.0), (1.0, 9.0)):
        history.add(time_s, np.array([value]))
    assert history.time_s.tolist() == [0.0, 1.0]
    assert history.values.ravel().tolist() == [1.0, 9.0]
