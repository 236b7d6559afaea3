from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from defras_bt.diagnosis.layout import layout
from defras_bt.diagnosis.problem import Channel, Samples


def _samples(time_s: list[float], channel: list[int], trajectory: list[int]) -> Samples:
    zeros = np.zeros(len(time_s), dtype=np.int64)
    return Samples(
        (Channel("a", "s", "m", 1.0, 0.1), Channel("b", "s", "m", 1.0, 0.1)),
        ("one", "two"),
        ("move",),
        np.array(time_s),
        np.array(channel),
        np.array(trajectory),
        zeros,
        zeros,
    )


def test_series_and_their_steps_with_a_gap() -> None:
    found = layout(_samples([0.0, 0.1, 0.4, 0.5, 0.0, 0.1], [0, 0, 0, 0, 1, 1], [0] * 6))
    assert [(s.start, s.stop, s.channel) for s in found.series] == [(0, 4, 0), (4, 6, 1)]
    assert found.series[0].slot.tolist() == [0, 1, 4, 5]


def test_series_with_the_same_steps_are_together() -> None:
    found = layout(_samples([0.0, 0.1, 0.0, 0.1, 0.0, 0.1], [0, 0, 1, 1, 0, 0], [0, 0, 0, 0, 1, 1]))
    assert [len(group) for group in found.together] == [2, 1]


def test_time_that_does_not_increase_is_refused_with_its_place() -> None:
    with pytest.raises(ValueError, match=r"time of a in one does not increase at 0\.1 s"):
        layout(_samples([0.0, 0.2, 0.1], [0, 0, 0], [0, 0, 0]))


def test_unsorted_and_unlabelled_samples_are_refused() -> None:
    samples = _samples([0.0, 0.1, 0.0], [1, 1, 0], [0, 0, 0])
    with pytest.raises(ValueError, match="sorted by trajectory, channel and time"):
        layout(samples)
    with pytest.raises(ValueError, match="fold labels 2 numbers"):
        layout(replace(samples, fold=np.zeros(2, dtype=np.int64)))
