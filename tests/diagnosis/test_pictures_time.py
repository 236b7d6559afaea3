"""What the curves over time are made of."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from defras_bt.diagnosis.pictures_time import MOST_ROWS, curve, phase_spans, rows, striking_rows
from tests.diagnosis.synthetic_diagnosis import PHASES, samples, synthetic_diagnosis


def test_many_channels_share_a_row_and_few_have_their_own() -> None:
    found = rows(samples())
    assert [row.name for row in found] == ["cloud", "force x", "force y", "force z"]
    assert [row.signed for row in found] == [False, True, True, True]
    assert found[0].noise_sd == 0.0003


def test_of_many_rows_the_most_striking_are_drawn() -> None:
    whole = synthetic_diagnosis()
    named = [c for c in whole.samples.channels if c.sensor == "force"]
    spare = tuple(replace(named[0], name=f"force {i}", sensor=f"spare {i}") for i in range(6))
    count = len(whole.samples.channels)
    channels = (*whole.samples.channels, *spare)
    quiet = np.flatnonzero(whole.samples.channel == 0)
    labels = replace(
        whole.samples,
        channels=channels,
        **{
            name: np.concatenate([getattr(whole.samples, name), *([values] * 6)])
            for name in ("time_s", "trajectory", "phase", "fold")
            for values in [getattr(whole.samples, name)[quiet]]
        },
        channel=np.concatenate(
            [whole.samples.channel, *(np.full(len(quiet), count + i) for i in range(6))]
        ),
    )
    still = np.zeros(6 * len(quiet))
    busy = replace(
        whole,
        samples=labels,
        held_out_before=np.concatenate([whole.held_out_before, still]),
    )
    assert len(rows(labels)) == 10
    names = [row.name for row in striking_rows(busy)]
    assert names[:4] == ["cloud", "force x", "force y", "force z"]
    assert len(names) == MOST_ROWS


def test_a_row_of_many_is_their_root_mean_square_without_what_was_not_seen() -> None:
    labels = samples()
    cloud = rows(labels)[0]
    residual = np.where(labels.channel % 2 == 0, 3.0, -4.0)
    residual[labels.channel == 1] = np.nan
    time_s, values = curve(labels, cloud, 1, residual)
    assert len(time_s) == 60
    expected = np.sqrt((18 * 9 + 17 * 16) / 35)
    np.testing.assert_allclose(values, expected)
    residual[labels.time_s == 0.0] = np.nan
    assert np.isnan(curve(labels, cloud, 1, residual)[1][0])


def test_a_row_of_one_keeps_its_sign() -> None:
    labels = samples()
    force_y = rows(labels)[2]
    residual = np.where(labels.channel == force_y.channels[0], -labels.time_s, 99.0)
    time_s, values = curve(labels, force_y, 0, residual)
    np.testing.assert_allclose(values, -time_s)


def test_phases_follow_each_other_without_gaps() -> None:
    spans = phase_spans(samples(), 0)
    assert [name for _, _, name in spans] == list(PHASES)
    assert all(one[1] == other[0] for one, other in itertools.pairwise(spans))


def test_channels_with_phases_of_their_own_have_none_in_common() -> None:
    labels = samples()
    apart = replace(labels, phase=np.where(labels.channel == 3, 0, labels.phase))
    assert phase_spans(apart, 0) == []
