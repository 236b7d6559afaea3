"""HumanHelps asks for a human only where the failure's code says that one can help."""

import pytest
from py_trees.common import Status

from defras_bt.executive.nodes import HumanHelps
from defras_bt.executive.reasons import Code
from defras_bt.recording.record import Cause


@pytest.mark.parametrize("code", [Code.PLAN_REFUSED, Code.JAW_STUCK, Code.STALE])
def test_a_human_helps(bench, code):
    bench.fails(code, "what happened")
    node = bench.node(HumanHelps)
    assert (bench.tick(node), node.code) == (Status.SUCCESS, Code.HUMAN_HELPS)
    assert node.feedback_message == "a human can help: what happened"


@pytest.mark.parametrize("code", [Code.IMPOSSIBLE, Code.PAUSED])
def test_a_human_does_not_help(bench, code):
    bench.fails(code, "what happened")
    node = bench.node(HumanHelps)
    assert (bench.tick(node), node.code) == (Status.FAILURE, Code.WOULD_NOT_HELP)


def test_nothing_failed(bench):
    node = bench.node(HumanHelps)
    assert (bench.tick(node), node.code) == (Status.FAILURE, Code.WOULD_NOT_HELP)


def test_a_code_of_somebody_else_s_rules_nothing_out(bench):
    bench.failure = Cause("too_cold", "the probe is too cold")
    node = bench.node(HumanHelps)
    assert bench.tick(node) == Status.SUCCESS
