"""Fitted and judging points never mix."""

from __future__ import annotations

import numpy as np

from defras_bt.learning.estimate import Keyframe
from defras_bt.learning.hold_out import Cells, split
from defras_sim.geometry import Pose


def frames(count: int) -> list[Keyframe]:
    rng = np.random.default_rng(0)
    grasp = Pose(np.zeros(3))
    return [
        Keyframe(
            float(i),
            {"psm1": grasp},
            {"psm1": grasp.moved(np.array([0.0, 0.0, 0.006 * i]))},
            rng.uniform(-0.05, 0.05, (200, 3)),
        )
        for i in range(count)
    ]


def test_neighbouring_cubes_differ_in_colour_and_key() -> None:
    cells = Cells.of(np.array([[0.001, 0.001, 0.001], [0.012, 0.001, 0.001], [0.009, 0, 0]]))
    assert cells.black.tolist() == [True, False, True]
    assert cells.key[0] == cells.key[2] != cells.key[1]


def test_the_second_newest_frame_is_held_out_whole() -> None:
    given = frames(6)
    parts = split(given, most_fitted=3, least_travel_m=0.005)
    assert parts.fitted == (1, 3, 5)
    assert len(parts.judging_points_m[4]) == 200
    assert len(parts.judging_points_m[0]) == 0  # nothing moved yet


def test_no_point_both_fits_and_judges() -> None:
    given = frames(6)
    parts = split(given, most_fitted=3, least_travel_m=0.005)
    for index, fitted in zip(parts.fitted, parts.fitted_points_m, strict=True):
        judging = parts.judging_points_m[index]
        assert len(fitted) + len(judging) == 200
        assert not set(Cells.of(fitted).key) & set(Cells.of(judging).key)


def test_few_frames_are_all_fitted() -> None:
    assert split(frames(3), 3, 0.005).fitted == (1, 2)
    assert split(frames(2), 3, 0.005).fitted == (1,)
    assert split(frames(1), 3, 0.005).fitted == ()
