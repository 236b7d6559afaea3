"""When something may have begun: dated to a frame where the data say so."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from defras_bt.diagnosis.problem import Tangent
from defras_bt.diagnosis.twins.tissue_gains import Gains
from defras_bt.diagnosis.twins.tissue_onsets import Onsets
from defras_bt.diagnosis.twins.tissue_part import TissuePart
from defras_sim.geometry import Floats

TIME_S = np.arange(0.0, 10.0, 0.1)
HELD = (TIME_S > 1.95) & (TIME_S < 8.95)


def part(residual: Floats) -> TissuePart:
    """One row of residuals, with tissue held from 2 s to 8.9 s."""
    motion = SimpleNamespace(time_s=TIME_S, arms={"psm1": SimpleNamespace(grasped=HELD)})
    trajectory = SimpleNamespace(motion=motion, time_s=TIME_S, frames=np.arange(len(TIME_S)))
    found: Any = SimpleNamespace(trajectory=trajectory, residual=residual[None], shape=(1, 100))
    return cast(TissuePart, found)


def onsets(residual: Floats) -> Onsets:
    one = part(residual)
    return Onsets([one], Gains([one], np.array([0.5])))


def step_from(start_s: float) -> Floats:
    return (start_s <= TIME_S).astype(float)


@pytest.mark.parametrize("began_s", [2.65, 5.25, 6.15, 8.45])
def test_a_jump_is_dated_to_its_frame(began_s: float) -> None:
    rng = np.random.default_rng(3)
    residual = step_from(began_s) + rng.normal(0.0, 0.1, len(TIME_S))
    tried = onsets(residual).columns(4, step_from)
    assert any(abs(start - began_s) < 0.06 for start, _ in tried)
    assert len(tried) < 20
    assert all(np.array_equal(column, step_from(start)) for start, column in tried)


def test_nothing_begins_while_no_tissue_is_held() -> None:
    spread = onsets(np.zeros(100)).spread(1000)
    assert min(spread) > 1.85
    assert max(spread) < 8.95


def test_onsets_lie_between_frames() -> None:
    for start in onsets(np.zeros(100)).spread(5):
        assert np.abs(TIME_S - start).min() == pytest.approx(0.05)


def test_the_best_tangent_explains_most_and_none_explains_against_its_direction() -> None:
    rng = np.random.default_rng(1)
    residual = step_from(5.05) + rng.normal(0.0, 0.05, 100)
    gains = Gains([part(residual)], np.array([0.5]))
    columns = [step_from(2.05), -step_from(5.05), step_from(5.05), rng.normal(size=100)]
    tangents = [Tangent({}, ({"a": 1.0},), column[:, None]) for column in columns]
    assert gains.best(tangents, 0.1) == [tangents[2], tangents[0]]
    assert gains.of(columns[1]) == 0.0
    assert gains.of(columns[2]) == pytest.approx(gains.whole, rel=0.05)
