"""Each kind of cause stands out in its own number, and noise in none."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.diagnosis.diagnosis import Statistic
from defras_bt.diagnosis.layout import layout
from defras_bt.diagnosis.noise import estimate_noise
from defras_bt.diagnosis.portrait import portrait
from defras_bt.diagnosis.problem import Channel, Covariate, Samples
from defras_sim.geometry import Floats
from tests.diagnosis.toy_problem import coloured, play, wander

LENGTH, SIDE, DT = 400, 3, 0.05
CELLS = SIDE * SIDE
TIME_S = DT * np.arange(LENGTH)
PLACES_M = [(0.01 * i, 0.01 * j) for i in range(SIDE) for j in range(SIDE)]
SETPOINT = wander(np.random.default_rng(0), LENGTH, 1, smooth=15)[:, 0]
HELD = (TIME_S > 5.0) & (TIME_S < 15.0)
SAMPLES = Samples(
    tuple(
        Channel(f"cell {i}", "cloud", "m", 0.001, 0.0003, place) for i, place in enumerate(PLACES_M)
    ),
    ("run",),
    ("pull", "hold"),
    np.tile(TIME_S, CELLS),
    np.repeat(np.arange(CELLS), LENGTH),
    np.zeros(CELLS * LENGTH, dtype=np.int64),
    np.tile(HELD.astype(np.int64), CELLS),
    np.tile(np.arange(LENGTH) // 50, CELLS),
)


def _noise(seed: int) -> Floats:
    rng = np.random.default_rng(seed)
    return 0.001 * np.concatenate([coloured(rng, LENGTH, (0.6,)) for _ in range(CELLS)])


def _portrait(change: Floats, seed: int = 1) -> tuple[Statistic, ...]:
    """Of noise plus ``change`` (cells, times)."""
    left = _noise(seed)
    found = layout(SAMPLES)
    noise = estimate_noise(left, SAMPLES, found)
    covariate = Covariate("set-point", "m", np.tile(SETPOINT, CELLS), followed=True)
    rng = np.random.default_rng(seed)
    return portrait(left + change.ravel(), SAMPLES, found, noise, left, [covariate], rng)


def _largest(found: tuple[Statistic, ...], kind: str) -> Statistic:
    own = [one for one in found if one.kind == kind]
    return max(own, key=lambda one: abs(one.value) / max(one.chance or 1e-300, 1e-300))


CHANGES: dict[str, Floats] = {
    "mean": np.full((CELLS, LENGTH), 0.001),
    "drift": np.tile(
        np.where(HELD, 0.002 * (1.0 - np.exp(-(TIME_S - 5.0) / 3.0)), 0.0), (CELLS, 1)
    ),
    "reversal": np.tile(0.002 * (play(SETPOINT, 0.8) - SETPOINT), (CELLS, 1)),
    "lag": np.tile(-0.0005 * np.gradient(SETPOINT, DT), (CELLS, 1)),
    "slope": np.tile(0.001 * SETPOINT, (CELLS, 1)),
    "jump": np.tile(np.where(TIME_S > 9.0, 0.003, 0.0), (CELLS, 1)),
    "line": np.tile(0.001 * np.sin(2.0 * np.pi * 0.5 * TIME_S), (CELLS, 1)),
    "rigid": np.array([[0.05 * (x - 0.01)] for x, _ in PLACES_M]) * np.ones(LENGTH),
    "mode": np.array([[0.004 if i == 4 else 0.0] for i in range(CELLS)]) * np.abs(SETPOINT),
}


@pytest.mark.parametrize("kind", list(CHANGES))
def test_a_cause_stands_out_in_its_number(kind: str) -> None:
    found = _largest(_portrait(CHANGES[kind]), kind)
    assert found.stands_out
    assert "by chance up to" in found.sentence
    assert not _largest(_portrait(0.0 * CHANGES[kind]), kind).value > 3.0 * (found.chance or 0.0)


def test_lag_is_in_seconds_and_offset_in_the_channel_s_unit() -> None:
    assert _largest(_portrait(CHANGES["lag"]), "lag").value == pytest.approx(0.0005, rel=0.3)
    assert _largest(_portrait(CHANGES["mean"]), "mean").value == pytest.approx(0.001, rel=0.3)
    assert "cell" in _largest(_portrait(CHANGES["mean"]), "mean").sentence
    assert " mm off on average" in _largest(_portrait(CHANGES["mean"]), "mean").sentence


def test_of_noise_alone_few_numbers_stand_out() -> None:
    judged = [
        one for seed in range(4) for one in _portrait(np.zeros((CELLS, LENGTH)), seed) if one.chance
    ]
    assert sum(one.stands_out for one in judged) < 0.15 * len(judged)
