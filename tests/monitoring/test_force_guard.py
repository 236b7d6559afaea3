"""The force guard accepts nothing that it cannot compare."""

from __future__ import annotations

from dataclasses import replace

import pytest
from py_trees.common import Status

from defras_bt.executive.perception import Perception
from defras_bt.executive.testing import NodeBench
from defras_bt.monitoring.guards import ForceAccepted
from defras_bt.recording.operator_state import NOBODY

NAN = float("nan")


@pytest.mark.parametrize(
    ("force_n", "limit_n", "status"),
    [
        (0.1, 0.3, Status.SUCCESS),
        (NAN, 0.3, Status.FAILURE),
        (0.1, NAN, Status.FAILURE),
    ],
)
def test_force_and_threshold_must_be_numbers(force_n, limit_n, status):
    bench = NodeBench()
    guard = bench.node(ForceAccepted, patience_s=0.5)
    bench.board.begin_tick(replace(bench.board.inputs, force_n=force_n, force_threshold_n=limit_n))
    assert guard.update() is status


@pytest.mark.parametrize(("limit_n", "counts"), [(0.3, False), (NAN, True)])
def test_a_threshold_that_is_not_a_number_counts_as_exceeded(limit_n, counts):
    bench = NodeBench()
    senses = Perception(bench.board, bench.twin, bench.monitor, bench.keyframes, limit_n)
    senses.update(0, bench.world.observe(), NOBODY)
    assert (bench.board.force_over_s > 0.0) is counts
