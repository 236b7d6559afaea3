"""The desk: which act is possible when, what becomes of plans that wait, and threads."""

from __future__ import annotations

import itertools
from threading import Thread

import pytest

from defras_bt.executive.operator_desk import NEXT, OperatorDesk
from defras_bt.executive.testing import plan_of
from defras_bt.recording.operator_state import Act, Mode

PLAN, OTHER = plan_of((2, 4)), plan_of((2, 5))
MODES = {
    Mode.AUTONOMOUS: (),
    Mode.PAUSED: (Act.PAUSE,),
    Mode.TAKEN_OVER: (Act.TAKE_OVER,),
    Mode.STOPPED: (Act.STOP,),
}


def desk_in(mode: Mode) -> OperatorDesk:
    desk = OperatorDesk()
    for act in MODES[mode]:
        assert desk.request(act, "test").accepted
    desk.state()
    return desk


@pytest.mark.parametrize(("mode", "act"), [*itertools.product(Mode, Act)])
def test_every_act_in_every_mode(mode, act):
    desk = desk_in(mode)
    answer = desk.request(act, "test", "because")
    state = desk.state()
    if act in NEXT[mode]:
        assert answer.accepted
        assert state.mode is NEXT[mode][act]
        assert [(done.act, done.source, done.words) for done in state.acts] == [
            (act, "test", "because")
        ]
    else:
        assert not answer.accepted
        assert "is not possible" in answer.sentence
        assert (state.mode, state.acts) == (mode, ())


def test_only_autonomy_permits_motion():
    for mode in Mode:
        assert (desk_in(mode).state().forbids is None) == (mode is Mode.AUTONOMOUS)


def test_an_act_that_no_tick_heeds_any_more_is_told_to_be_too_late():
    desk = OperatorDesk()
    said = []
    desk.listen(lambda notice: said.append(notice.sentence))
    desk.request(Act.PAUSE, "terminal")
    desk.state()
    desk.request(Act.STOP, "socket")
    desk.close()
    assert said[-2:] == [
        "Too late: the operation ended before it could heed stop (socket).",
        "The operation has ended.",
    ]
    assert desk.state().acts == ()


def test_what_was_taken_over_is_not_given_back_by_resuming():
    answer = desk_in(Mode.TAKEN_OVER).request(Act.RESUME, "another front end")
    assert answer.sentence == (
        "resume is not possible: the operator has taken over the arms; "
        "possible now: hand back, stop"
    )


def test_a_stop_is_final():
    desk = desk_in(Mode.STOPPED)
    assert all(not desk.request(act, "test").accepted for act in Act)


def test_acts_are_told_once():
    desk = OperatorDesk()
    desk.request(Act.PAUSE, "a")
    desk.request(Act.RESUME, "b")
    assert [done.source for done in desk.state().acts] == ["a", "b"]
    assert desk.state().acts == ()


class TestApproval:
    """Plans wait until they are answered; a question that is not asked again is withdrawn."""

    @pytest.fixture
    def desk(self):
        return OperatorDesk(asks=True)

    def ask(self, desk, plan=PLAN):
        """One tick in which the tree asks."""
        desk.state()
        return desk.approve(plan)

    def test_nobody_is_asked_unless_wanted(self):
        assert OperatorDesk().approve(PLAN) is True

    @pytest.mark.parametrize(("act", "expected"), [(Act.APPROVE, True), (Act.REFUSE, False)])
    def test_an_answer(self, desk, act, expected):
        assert self.ask(desk) is None
        assert "1. PSM1 pulls the tissue up" in desk.notice().question
        assert self.ask(desk) is None
        assert desk.request(act, "test").accepted
        assert self.ask(desk) is expected
        assert desk.notice().question == ""

    def test_an_answer_holds_for_its_plan_alone(self, desk):
        self.ask(desk)
        desk.request(Act.APPROVE, "test")
        assert self.ask(desk, OTHER) is None

    def test_a_plan_that_was_replaced_cannot_be_approved(self, desk):
        self.ask(desk)
        read = desk.notice().plan_number
        self.ask(desk, OTHER)
        answer = desk.request(Act.APPROVE, "test", plan_number=read)
        assert not answer.accepted
        assert "was replaced by plan 2" in answer.sentence
        assert desk.request(Act.APPROVE, "test", plan_number=2).accepted

    def test_a_tick_without_asking_withdraws_the_question(self, desk):
        self.ask(desk)
        desk.state()
        desk.state()
        assert desk.notice().question == ""
        assert not desk.request(Act.APPROVE, "test").accepted

    def test_nothing_waits_nothing_to_approve(self, desk):
        answer = desk.request(Act.APPROVE, "test")
        assert "no plan waits for approval" in answer.sentence


def test_listeners_hear_every_change_until_they_leave():
    desk, heard = OperatorDesk(asks=True), []
    leave = desk.listen(heard.append)
    desk.request(Act.PAUSE, "test")
    desk.request(Act.RESUME, "test")
    desk.approve(PLAN)
    leave()
    desk.request(Act.STOP, "test")
    assert [notice.mode for notice in heard] == [Mode.PAUSED, Mode.AUTONOMOUS, Mode.AUTONOMOUS]
    assert heard[-1].question


def test_an_idle_tick_ends_as_soon_as_somebody_speaks():
    desk = OperatorDesk(idle_s=30.0)
    desk.request(Act.PAUSE, "test")
    waiting = Thread(target=desk.idle)
    waiting.start()
    desk.request(Act.RESUME, "test")
    waiting.join(timeout=10.0)
    assert not waiting.is_alive()


def test_many_threads_lose_no_act():
    desk = OperatorDesk()
    taken = []

    def press():
        for _ in range(200):
            for act in (Act.PAUSE, Act.RESUME):
                if desk.request(act, "test").accepted:
                    taken.append(act)

    threads = [Thread(target=press) for _ in range(4)]
    for thread in threads:
        thread.start()
    told = []
    while any(thread.is_alive() for thread in threads):
        told += desk.state().acts
    told += desk.state().acts
    assert len(told) == len(taken)
    alternating = [Act.PAUSE, Act.RESUME] * len(told)
    assert [done.act for done in told] == alternating[: len(told)]


def test_after_the_outcome_nothing_is_possible_and_no_plan_waits():
    desk, heard = OperatorDesk(asks=True), []
    desk.approve(PLAN)
    desk.listen(heard.append)
    desk.close()
    for act in Act:
        answer = desk.request(act, "test")
        assert not answer.accepted
        assert answer.sentence.endswith("is not possible: the operation has ended")
    assert (desk.notice().question, desk.notice().possible) == ("", ())
    assert desk.state().acts == ()
    assert [notice.sentence for notice in heard] == ["The operation has ended."]
