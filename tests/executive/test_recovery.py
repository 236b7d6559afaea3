"""A recovery runs only where the failure's code says that it may help."""

import pytest
from py_trees.common import Status

from defras_bt.executive.reasons import Code, Remedy
from defras_bt.executive.recovery import RecoveryLeaf
from defras_bt.executive.testing import NodeBench
from defras_bt.learning.nodes import LearnAttachments
from defras_bt.planning.nodes import Replan
from defras_bt.recording.record import Cause


class Mend(RecoveryLeaf):
    """Learns, or fails to."""

    remedy = Remedy.LEARN
    outcome = Status.SUCCESS

    def recover(self):
        if self.outcome == Status.SUCCESS:
            return self.succeed(Code.ADOPTED, "learned")
        return self.fail(Code.REJECTED, "learned nothing")


@pytest.fixture
def bench():
    return NodeBench()


def test_it_is_not_tried_against_what_it_cannot_mend(bench):
    bench.fails(Code.STALE, "the cloud is 0.60 s old")
    mend = bench.node(Mend)
    assert (bench.tick(mend), mend.code) == (Status.FAILURE, Code.WOULD_NOT_HELP)
    assert mend.feedback_message == (
        "learning the attachments does not help against this: the cloud is 0.60 s old"
    )
    assert bench.board.failure.code == Code.STALE, "what failed is still to be mended"


@pytest.mark.parametrize("failed", [None, Cause(Code.WARNED, "state 2"), Cause("mine", "mine")])
def test_it_is_tried_otherwise(bench, failed):
    bench.failure = failed
    assert bench.tick(bench.node(Mend)) == Status.SUCCESS
    assert bench.board.failure == failed


def test_what_it_could_not_do_is_the_next_thing_to_mend(bench):
    bench.fails(Code.WARNED, "state 2")
    mend = bench.node(Mend)
    mend.outcome = Status.FAILURE
    bench.tick(mend)
    assert bench.board.failure == Cause(Code.REJECTED, "learned nothing")


def test_nothing_is_learned_from_a_stale_camera(bench):
    bench.hold()
    bench.fails(Code.STALE)
    node = bench.node(LearnAttachments)
    assert (bench.tick(node), node.code) == (Status.FAILURE, Code.WOULD_NOT_HELP)
    assert not bench.board.unexplained


def test_no_plan_is_made_after_a_refusal(bench):
    bench.fails(Code.PLAN_REFUSED)
    node = bench.node(Replan)
    assert (bench.tick(node), node.code) == (Status.FAILURE, Code.WOULD_NOT_HELP)
    assert bench.planner.asked == []
