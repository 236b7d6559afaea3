"""Scatter of sensors from the frames at rest: white, remembering, and where there is no rest."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.diagnosis.problem import Integers
from defras_bt.diagnosis.twins.tissue_noise import noise_sd
from defras_bt.diagnosis.twins.tissue_phases import PHASES
from defras_sim.geometry import Floats

SD_M = 2e-4
ROWS = np.zeros(40, np.int64)


def phases(rest: int, pull: int) -> Integers:
    return np.repeat([PHASES.index("rest"), PHASES.index("pull")], [rest, pull])


def remembering(rng: np.random.Generator, frames: int, memory: float) -> Floats:
    """Noise (rows, frames) of standard deviation :data:`SD_M`."""
    noise = rng.standard_normal((len(ROWS), frames + 100))
    for frame in range(1, noise.shape[1]):
        noise[:, frame] *= np.sqrt(1 - memory**2)
        noise[:, frame] += memory * noise[:, frame - 1]
    return SD_M * noise[:, 100:]


@pytest.mark.parametrize("memory", [0.0, 0.5, 0.8])
def test_a_short_rest_tells_the_whole_scatter(memory: float) -> None:
    rng = np.random.default_rng(3)
    found = [
        np.median(noise_sd([remembering(rng, 60, memory)], [phases(30, 30)], ROWS))
        for _ in range(30)
    ]
    assert np.mean(found) == pytest.approx(SD_M, rel=0.12)


def test_motion_does_not_count_where_there_was_a_rest() -> None:
    rng = np.random.default_rng(4)
    moving = remembering(rng, 80, 0.0)
    moving[:, 40:] += 0.01 * np.linspace(0, 1, 40)
    assert np.median(noise_sd([moving], [phases(40, 40)], ROWS)) == pytest.approx(SD_M, rel=0.15)


def test_without_a_rest_neighbouring_frames_tell() -> None:
    rng = np.random.default_rng(5)
    slow = remembering(rng, 80, 0.0) + 0.002 * np.linspace(0, 1, 80)
    assert np.median(noise_sd([slow], [phases(0, 80)], ROWS)) == pytest.approx(SD_M, rel=0.15)


def test_rows_lend_each_other_what_they_know_of_their_kind() -> None:
    rng = np.random.default_rng(6)
    rest = remembering(rng, 12, 0.0)
    rest[0] = np.nan
    rest[1:, :] *= np.r_[np.ones(20), np.full(19, 1000.0)][:, None]
    kinds = np.r_[np.zeros(21, np.int64), np.ones(19, np.int64)]
    found = noise_sd([rest], [phases(12, 0)], kinds)
    assert found[0] == pytest.approx(np.median(found[1:21]), rel=0.3)
    assert np.median(found[21:]) == pytest.approx(1000 * SD_M, rel=0.3)
    own = 1.4826 * np.median(np.abs(rest[1:21] - np.median(rest[1:21], axis=1)[:, None]), axis=1)
    assert np.ptp(found[1:21]) < 0.7 * np.ptp(own)
