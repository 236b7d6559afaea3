"""Pause, resume, take over, hand back in whole trees: nothing moves, and then what is true counts.

Tree, gate, perception and executive are the real ones.
"""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.executive.operator_desk import OperatorDesk
from defras_bt.executive.reasons import Code
from defras_bt.executive.testing import EPSILON_N, plan_of
from defras_bt.recording.operator_state import Act
from defras_sim.worlds.protocol import HOLD
from tests.executive.stage import Stage, doing, leaves, moving

TREES = ("defras", "defras_paper", "fras")
EXPOSES = ("pull", "move", "fold")


@pytest.fixture(params=TREES)
def stage(request) -> Stage:
    return on_stage(request.param)


def on_stage(tree: str) -> Stage:
    stage = Stage(tree)
    for point in stage.bench.planner.points:
        stage.bench.rehearse.shows[point, EXPOSES] = (1.0, 0.1)
    return stage


def names(stage: Stage) -> list[str]:
    return [action.name for action in stage.board.plan.actions]


HOLDS = [(Act.PAUSE, Act.RESUME), (Act.TAKE_OVER, Act.HAND_BACK)]


@pytest.mark.parametrize("phase", ["reach", "pull", "fold"])
@pytest.mark.parametrize(("begin", "end"), HOLDS)
def test_nothing_moves_from_the_same_tick_until_the_end(stage, phase, begin, end):
    stage.until_doing(phase)
    held = dict(stage.board.grips)
    stage.operator(begin)
    for record in stage.ticks(5.0):
        assert record.sent == HOLD
        assert doing(record) is None
        assert leaves(record)["wait_for_operator"] == "RUNNING"
    assert stage.board.outcome is None
    assert stage.board.grips == held, "the grip is kept"
    stage.operator(end)
    stage.until("it moves again", lambda r: any(moving(r).values()), most_s=1.0)


@pytest.mark.parametrize(("begin", "end"), HOLDS)
def test_afterwards_it_plans_anew_and_finishes_what_was_half_done(stage, begin, end):
    stage.until_doing("move")
    old = stage.board.plan
    stage.operator(begin)
    stage.ticks(1.0)
    stage.operator(end)
    stage.until_doing("move", most_s=1.0)
    assert stage.board.plan is not old
    assert names(stage) == ["move", "fold"]
    assert len(stage.notes.told("replan")) == 1


def test_a_plan_that_was_never_begun_is_not_begun_afterwards(stage):
    """Spliced in one tick, paused in the next: its first action was never ticked."""
    stage.until("a plan is in place", lambda r: stage.board.plan is not None)
    old = stage.board.plan
    stage.operator(Act.TAKE_OVER)
    stage.ticks(0.5)
    stage.operator(Act.HAND_BACK)
    stage.until_doing("reach")
    assert stage.board.plan is not old


class TestTakenOver:
    """While the operator drives the world changes."""

    @pytest.fixture
    def taken(self, stage):
        stage.until_doing("move")
        stage.operator(Act.TAKE_OVER, "let me see")
        stage.ticks(0.5)
        return stage

    def back(self, stage):
        stage.operator(Act.HAND_BACK)
        stage.until("it moves again", lambda r: any(moving(r).values()), most_s=2.0)

    def test_tissue_that_was_let_go_is_reached_for_again(self, taken):
        taken.bench.world.tools["psm1"].grasped = False
        taken.ticks(0.2)
        self.back(taken)
        assert names(taken)[0] == "reach"
        assert "PSM1 does not hold the tissue any more" in taken.notes.told("operator")[-1]

    def test_tissue_that_was_moved_is_retracted_from_where_it_is(self, taken):
        taken.bench.put("psm1", taken.bench.tip_m() + np.array([0.0, 0.01, -0.02]))
        taken.ticks(0.2)
        self.back(taken)
        assert names(taken) == list(EXPOSES), "what was done counts for the old place only"
        assert taken.board.grips["psm1"].point == (2, 4)
        assert "PSM1 stands 22 mm from where it was" in taken.notes.told("operator")[-1]

    def test_tissue_that_was_left_alone_is_not_retracted_twice(self, taken):
        self.back(taken)
        assert names(taken) == ["move", "fold"]
        assert "arms and grips are as they were" in taken.notes.told("operator")[-1]

    def test_tissue_held_elsewhere_counts_as_held_there(self, taken):
        tool = taken.bench.world.tools["psm1"]
        tool.grasped = False
        taken.ticks(0.2)
        taken.bench.put("psm1", (*taken.bench.scene.grasp_xy_m(2, 5), 0.0))
        tool.grasped = True
        taken.ticks(0.2)
        assert taken.board.grips["psm1"].point == (2, 5)
        self.back(taken)
        assert names(taken) == list(EXPOSES)
        assert "holds the tissue at (2, 5), no more at (2, 4)" in taken.notes.told("operator")[-1]

    def test_the_region_seen_meanwhile_ends_the_run_only_when_handed_back(self, taken):
        taken.bench.world.visibility = 1.0
        taken.ticks(1.0)
        assert taken.board.outcome is None
        taken.operator(Act.HAND_BACK)
        taken.until_over()
        assert taken.board.outcome == "goal"

    @pytest.mark.parametrize("trouble", ["warning", "force", "camera"])
    def test_no_trouble_takes_the_arms_from_the_operator(self, taken, trouble):
        if trouble == "warning":
            taken.warn(3)
        elif trouble == "force":
            taken.bench.twin.feels_n = 2 * EPSILON_N
        else:
            taken.bench.world.cloud_m = None
        records = taken.ticks(5.0)
        assert all(record.sent == HOLD for record in records)
        assert taken.board.outcome is None

    def test_a_stop_still_ends_the_run(self, taken):
        taken.operator(Act.STOP)
        assert taken.tick().sent == HOLD
        assert (taken.board.outcome, taken.board.outcome_cause.code) == ("human", Code.STOPPED)


def test_arms_taken_and_given_back_within_one_tick_are_trusted_no_more(stage):
    """A tick in which much is computed may last long enough."""
    stage.until_doing("move")
    old = stage.board.plan
    stage.operator(Act.TAKE_OVER)
    stage.operator(Act.HAND_BACK)
    stage.until("a new plan", lambda r: stage.board.plan is not old, most_s=1.0)
    assert names(stage) == list(EXPOSES)
    assert stage.notes.told("operator")[-1].endswith("nobody knows what changed.")


def test_the_acts_are_told_with_their_words(stage):
    stage.until_doing("reach")
    stage.operator(Act.PAUSE, "swab")
    record = stage.tick()
    (event,) = [event for event in record.events if event.kind == "operator"]
    assert event.sentence == (
        'The operator paused the operation: nothing moves, the grip is kept. ("swab")'
    )
    assert event.data == {"act": "pause", "source": "test", "words": "swab"}
    assert record.operator.mode == "paused"
    assert record.cause.code == Code.OPERATOR_HOLDS


def test_time_held_does_not_count_as_operating_time():
    stage = Stage("fras", max_time_s=3.0)
    stage.until_doing("reach")
    stage.operator(Act.PAUSE)
    stage.ticks(10.0)
    assert stage.board.outcome is None
    stage.operator(Act.RESUME)
    stage.until_over(10.0)
    assert stage.board.outcome_cause.code == Code.TIME_OVER
    assert stage.notes.records[-1].time_s == pytest.approx(13.0, abs=0.3)


class TestApproval:
    """A plan waits for the operator while everything else goes on."""

    @pytest.fixture(params=TREES)
    def asking(self, request):
        desk = OperatorDesk(asks=True)
        stage = on_stage(request.param)
        object.__setattr__(stage.bench.context, "approve", desk.approve)
        stage.desk = stage.executive._operator = desk
        stage.until("a plan waits", lambda r: bool(desk.notice().question))
        return stage

    def test_nothing_moves_until_it_is_approved(self, asking):
        records = asking.ticks(5.0)
        assert all(record.sent == HOLD for record in records)
        assert records[-1].cause.code == Code.AWAITING_APPROVAL
        assert len(asking.bench.planner.asked) <= 2, "planned once, not every tick"
        asking.operator(Act.APPROVE)
        asking.until_doing("reach", most_s=0.5)
        assert asking.notes.told("operator") == ["The operator approved the plan."]

    def test_a_refusal_asks_a_human(self, asking):
        asking.operator(Act.REFUSE)
        asking.tick()
        assert asking.board.outcome == "human"
        assert asking.board.outcome_cause.code == Code.PLAN_REFUSED

    def test_another_situation_shows_another_plan(self, asking):
        number = asking.desk.notice().plan_number
        asking.bench.world.tools["psm1"].grasped = True
        asking.ticks(0.2)
        assert asking.desk.notice().plan_number == number + 1
        assert "reaches" not in asking.desk.notice().question
        assert asking.bench.planner.asked[-1].arms["psm1"].holding is not None

    def test_a_pause_withdraws_the_question_and_resuming_asks_again(self, asking):
        number = asking.desk.notice().plan_number
        asking.operator(Act.PAUSE)
        asking.ticks(0.2)
        assert asking.desk.notice().question == ""
        asking.operator(Act.RESUME)
        asking.ticks(0.2)
        assert asking.desk.notice().plan_number == number + 1
        asking.operator(Act.APPROVE)
        asking.until_doing("reach", most_s=0.5)

    def test_a_stop_is_heard_while_a_plan_waits(self, asking):
        asking.operator(Act.STOP)
        asking.tick()
        assert asking.board.outcome_cause.code == Code.STOPPED

    def test_a_silent_camera_is_noticed_while_a_plan_waits(self, asking):
        asking.bench.world.cloud_m = None
        assert asking.until_over() == "human"
        assert asking.board.outcome_cause.code == Code.STALE


def test_a_plan_from_before_the_operation_is_shown_again_after_a_pause():
    desk = OperatorDesk(asks=True)
    stage = on_stage("defras")
    plan = plan_of((3, 4), ("reach", "open", "grasp", "pull"))
    for name, value in {"approve": desk.approve, "preoperative": plan}.items():
        object.__setattr__(stage.bench.context, name, value)
    stage.desk = stage.executive._operator = desk
    stage.until("a plan waits", lambda r: bool(desk.notice().question))
    stage.operator(Act.PAUSE)
    stage.ticks(0.2)
    stage.operator(Act.RESUME)
    stage.until("a plan waits", lambda r: bool(desk.notice().question))
    stage.operator(Act.APPROVE)
    stage.until_doing("reach")
    assert stage.board.plan is plan
