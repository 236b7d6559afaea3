"""Draws of the twin's own errors: as large as the floors say, alike where patches are near."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.diagnosis.problem import Channel, Samples
from defras_bt.diagnosis.twins.tissue_approximation import (
    ALIKE_M,
    RELATIVE,
    SHARE,
    approximation_errors,
)
from defras_bt.diagnosis.twins.tissue_phases import PHASES

PLACES_M = ((0.0, 0.0), (ALIKE_M, 0.0), (0.1, 0.0))
CHANNELS = (
    *(Channel(f"upper {i},1", "cloud", "m", 1e-4, 3e-4, at) for i, at in enumerate(PLACES_M)),
    Channel("lower 1,1", "cloud", "m", 1e-4, 9e-4, PLACES_M[0]),
    Channel("psm1 force x", "force", "N", 1e-3, 5e-3),
)
FRAMES = np.repeat([PHASES.index(name) for name in ("rest", "pull", "hold", "pull")], 5)


def samples() -> Samples:
    rows, count = len(CHANNELS), len(FRAMES)
    return Samples(
        CHANNELS,
        ("a",),
        PHASES,
        np.tile(np.arange(count, dtype=float), rows),
        np.repeat(np.arange(rows), count),
        np.zeros(rows * count, np.int64),
        np.tile(FRAMES, rows),
        np.zeros(rows * count, np.int64),
    )


def test_draws_are_as_large_as_floors_say_and_half_the_square_at_rest() -> None:
    drawn = approximation_errors(samples(), 4000, np.random.default_rng(1))
    drawn = drawn.reshape(len(CHANNELS), len(FRAMES), -1)
    expected = SHARE * np.array([c.floor for c in CHANNELS])
    assert drawn[:, 5:].std(axis=2).mean(axis=1) == pytest.approx(expected, rel=0.05)
    assert drawn[:, 0].std(axis=1) == pytest.approx(expected / np.sqrt(2), rel=0.05)
    assert np.array_equal(drawn[:, 0], drawn[:, 4])


def test_errors_stay_within_a_phase_and_partly_beyond() -> None:
    drawn = approximation_errors(samples(), 4000, np.random.default_rng(2))
    one = drawn.reshape(len(CHANNELS), len(FRAMES), -1)[0]
    assert np.array_equal(one[5], one[9])
    assert np.array_equal(one[5], one[15]), "the second pull passes the same shapes"
    assert np.corrcoef(one[5], one[10])[0, 1] == pytest.approx(0.5, abs=0.05)


def test_neighbours_are_off_alike() -> None:
    drawn = approximation_errors(samples(), 4000, np.random.default_rng(3))
    alike = np.corrcoef(drawn.reshape(len(CHANNELS), len(FRAMES), -1)[:, 5])
    assert alike[0, 1] == pytest.approx(np.exp(-0.5), abs=0.05)
    for other in (2, 3, 4):
        assert abs(alike[0, other]) < 0.06


def test_what_is_explained_is_wrong_by_a_share_where_it_shows() -> None:
    explained = np.zeros((len(CHANNELS), len(FRAMES)))
    explained[0, 5:10] = explained[0, 15:] = 0.02
    explained[2] = np.nan
    rng = np.random.default_rng(4)
    drawn = approximation_errors(samples(), 4000, rng, explained.ravel())
    sd = drawn.reshape(len(CHANNELS), len(FRAMES), -1).std(axis=2)
    known = SHARE * CHANNELS[0].floor
    assert sd[0, 5] == pytest.approx(np.hypot(known, RELATIVE * 0.02), rel=0.05)
    assert sd[0, 10] == pytest.approx(known, rel=0.05)
    assert sd[2, 5] == pytest.approx(SHARE * CHANNELS[2].floor, rel=0.05)


def test_where_meshes_disagree_by_more_than_floors_say_half_of_it_may_be_wrong() -> None:
    corrected = np.zeros((len(CHANNELS), len(FRAMES)))
    corrected[0, 15:18], corrected[0, 18:] = 4e-3, -2e-3
    corrected[1, 5:10] = SHARE * CHANNELS[1].floor
    corrected[2] = np.nan
    rng = np.random.default_rng(5)
    drawn = approximation_errors(samples(), 4000, rng, corrected=corrected.ravel())
    drawn = drawn.reshape(len(CHANNELS), len(FRAMES), -1)
    sd = drawn.std(axis=2)
    assert sd[0, 15] == pytest.approx(2e-3, rel=0.05)
    assert sd[0, 18] == pytest.approx(1e-3, rel=0.05)
    assert np.corrcoef(drawn[0, 15], drawn[0, 18])[0, 1] < -0.9
    for channel, frame in ((0, 5), (1, 5), (2, 5)):
        assert sd[channel, frame] == pytest.approx(SHARE * CHANNELS[channel].floor, rel=0.05)
