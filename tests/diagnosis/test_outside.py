"""What is left over, beside what a twin may be off by itself."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.diagnosis.layout import layout
from defras_bt.diagnosis.noise import estimate_noise
from defras_bt.diagnosis.outside import left_over
from defras_bt.diagnosis.problem import Channel, Samples
from defras_sim.geometry import Floats

CHANNELS, LENGTH = 40, 160
NOISE, FLOOR = 0.1, 0.3


@pytest.fixture(scope="module")
def samples() -> Samples:
    count = CHANNELS * LENGTH
    return Samples(
        tuple(Channel(f"patch {c}", "cloud", "mm", NOISE, FLOOR) for c in range(CHANNELS)),
        ("run",),
        ("move",),
        np.tile(0.1 * np.arange(LENGTH), CHANNELS),
        np.repeat(np.arange(CHANNELS), LENGTH),
        np.zeros(count, np.int64),
        np.zeros(count, np.int64),
        np.tile(np.arange(LENGTH) * 8 // LENGTH, CHANNELS),
    )


def _bumps(amplitudes: Floats) -> Floats:
    """A slow wave (n,) of this root mean square in each channel (c,)."""
    wave = np.sqrt(2.0) * np.sin(2.0 * np.pi * np.arange(LENGTH) / LENGTH)
    return np.outer(amplitudes, wave).ravel()


def _left(samples: Samples, of_one: float, off: Floats | None) -> tuple[str, ...]:
    rng = np.random.default_rng(0)
    amplitudes = np.zeros(CHANNELS)
    amplitudes[3] = of_one
    residual = NOISE * rng.standard_normal(CHANNELS * LENGTH) + _bumps(amplitudes)
    noise = estimate_noise(residual, samples, layout(samples))
    return left_over(residual, samples, noise, 200, rng, off).sensors


def test_of_many_channels_one_may_be_farther_off_than_is_usual(samples: Samples) -> None:
    rng = np.random.default_rng(1)
    off = np.stack([_bumps(0.5 * FLOOR * rng.standard_normal(CHANNELS)) for _ in range(200)], 1)
    # A third more than the floor: much for this channel, but one of forty is off by as much.
    assert _left(samples, 1.33 * FLOOR, None) == ("cloud",)
    assert _left(samples, 1.33 * FLOOR, off) == ()
    # None of forty is off by three times the floor.
    assert _left(samples, 3.0 * FLOOR, off) == ("cloud",)
    assert _left(samples, 0.0, off) == ()
