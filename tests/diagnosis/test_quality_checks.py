from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from defras_bt.diagnosis.quality import DataFault, DataQuality, Sieve
from defras_bt.diagnosis.quality_checks import backward_rows, pauses_s, spike_rows, zero_rows


@given(st.lists(st.floats(0, 100), max_size=30))
def test_what_is_left_of_the_time_always_rises(times: list[float]) -> None:
    time_s = np.array(times)
    kept = time_s[~backward_rows(time_s)]
    assert np.all(np.diff(kept) > 0)


@given(st.integers(0, 19), st.floats(1e3, 1e9))
def test_one_wild_stamp_costs_one_row(index: int, wild: float) -> None:
    time_s = np.arange(20.0)
    time_s[index] = wild
    lost = backward_rows(time_s)
    assert lost.sum() == (0 if index == 19 else 1)
    assert not lost.any() or lost[index]


def test_a_time_that_is_none_is_no_time() -> None:
    assert backward_rows(np.array([0.0, np.nan, 2.0, np.inf])).tolist() == [
        False, True, False, True,
    ]  # fmt: skip


def test_zeros_of_a_sensor_that_is_never_anything_else_are_no_fault() -> None:
    values = np.array([[1.0, 0.0], [0.0, 0.0], [2.0, 0.0]])
    assert zero_rows(values).tolist() == [False, True, False]
    assert not zero_rows(np.zeros((5, 3))).any()


def test_a_jump_that_lasts_is_no_spike() -> None:
    there = np.zeros((6, 3))
    there[3:, 0] = 1.0
    everything = np.ones(6, bool)
    assert not spike_rows(there, 0.1, everything).any()
    spike = np.zeros((6, 3))
    spike[3, 0] = 1.0
    assert np.flatnonzero(spike_rows(spike, 0.1, everything)).tolist() == [3]


def test_pauses_are_measured_by_the_sources_own_period() -> None:
    assert pauses_s(np.array([0.0, 1.0, 2.0, 9.0, 10.0])) == [(2.0, 9.0)]
    assert pauses_s(np.array([0.0, 10.0])) == []


def test_a_sieve_counts_each_row_once_and_names_each_stretch() -> None:
    sieve = Sieve("/tip", np.arange(10.0))
    sieve.leave_out(np.isin(np.arange(10), [1, 2, 7]), "zeros", "rows of zeros")
    sieve.leave_out(np.isin(np.arange(10), [2, 3]), "outlier", "a jump")
    zeros, jump = sieve.faults
    assert (zeros.rows, zeros.spans_s) == (3, ((1.0, 2.0), (7.0, 7.0)))
    assert (jump.rows, jump.spans_s) == (1, ((3.0, 3.0),))
    assert sieve.kept.sum() == 6
    assert zeros.sentence == "/tip: rows of zeros at 1.00 to 2.00 s, 7.00 s; 3 rows left out"


def test_qualities_of_several_files_keep_their_names() -> None:
    one = DataQuality({"/tip": 5}, (DataFault("/tip", "zeros", ((0.0, 0.0),), 1, "zeros"),))
    both = DataQuality.together({"a": one, "b": DataQuality({"/tip": 7})})
    assert both.rows == {"a:/tip": 5, "b:/tip": 7}
    assert both.left_out == {"a:/tip": 1}
    data = both.as_data()
    assert isinstance(data["faults"], list)
    assert data["faults"][0]["spans_s"] == [[0.0, 0.0]]
