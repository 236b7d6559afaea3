"""Replan plans from what is sensed now, and does not insist on points that failed."""

import pytest
from py_trees.common import Status
from pydantic import ValidationError

from defras_bt.executive.testing import NodeBench, plan_of
from defras_bt.planning.nodes import Replan
from defras_sim.worlds.protocol import JAW_OPEN_RAD

PULL, FOLD, MOVE = ("pull",), ("pull", "fold"), ("pull", "move")
ALL = ("pull", "move", "fold")


def names(plan):
    return [f"{action.name}{action.point}" for action in plan.actions]


def retraction(point, *manoeuvres):
    return [f"{name}{point}" for name in ("reach", "open", "grasp", *manoeuvres)]


class TestSituation:
    """What the planner is told."""

    def test_arms_as_they_are(self, bench):
        bench.hold((2, 4), done=("pull",))
        bench.put("psm2", bench.tip_m("psm2"), jaw_rad=JAW_OPEN_RAD)
        bench.board.at["psm2"] = (2, 2)
        bench.board.blocked.add((5, 5))
        bench.tick(bench.node(Replan, exposing=FOLD))
        (situation,) = bench.planner.asked
        one, two = situation.arms["psm1"], situation.arms["psm2"]
        assert (one.at, one.holding, one.jaw_open, one.done) == ((2, 4), (2, 4), False, PULL)
        assert (two.at, two.holding, two.jaw_open, two.done) == ((2, 2), None, True, ())
        assert situation.blocked == {(5, 5)}
        assert situation.exposing == FOLD

    def test_manoeuvres_done_since_the_grasp_are_not_repeated(self, bench):
        bench.hold((2, 4), done=("pull",))
        bench.tick(bench.node(Replan, exposing=ALL))
        assert names(bench.board.new_plan) == ["move(2, 4)", "fold(2, 4)"]


class TestAdoption:
    """What becomes of a plan."""

    def test_the_first_plan_is_no_replan(self, bench):
        node = bench.node(Replan)
        assert (bench.tick(node), node.code) == (Status.SUCCESS, "planned")
        assert names(bench.board.new_plan) == retraction((2, 4), *ALL)
        assert bench.told("plan") == ["A plan of 6 actions was found."]
        assert bench.told("replan") == []
        assert bench.board.plan_exposing == ALL
        assert bench.board.command.arms == {}

    def test_every_later_one_is(self, bench):
        bench.board.plan = plan_of((2, 4))
        bench.tick(bench.node(Replan))
        assert bench.told("replan") == ["Planned anew from what is true now: 6 actions."]

    def test_also_after_a_plan_from_before_the_operation(self, bench):
        bench.board.preoperative_used = True
        bench.tick(bench.node(Replan))
        assert len(bench.told("replan")) == 1

    def test_no_plan_fails_with_the_planner_s_reason(self, bench):
        bench.board.blocked.update(bench.planner.points)
        node = bench.node(Replan)
        assert (bench.tick(node), node.code) == (Status.FAILURE, "impossible")
        assert "every grasp point is blocked" in bench.board.no_plan
        assert bench.board.new_plan is None

    def test_the_operator_can_refuse(self):
        bench = NodeBench(approve=lambda plan: False)
        node = bench.node(Replan)
        assert (bench.tick(node), node.code) == (Status.FAILURE, "plan_refused")
        assert bench.board.new_plan is None
        assert "did not approve" in bench.board.operator_refused


class TestExhaustedPoints:
    """A retraction that ended without showing the region will not show it later."""

    @pytest.mark.parametrize(
        ("planned", "done", "blocked"),
        [
            (FOLD, PULL, False),
            (FOLD, FOLD, True),
            (FOLD, ALL, True),
            (ALL, FOLD, False),
            ((), PULL, False),
        ],
    )
    def test_a_point_is_blocked_once_its_retraction_is_finished(
        self, bench, planned, done, blocked
    ):
        bench.hold((2, 4), done=done)
        bench.board.plan_exposing = planned
        bench.tick(bench.node(Replan, exposing=ALL))
        assert bench.board.blocked == ({(2, 4)} if blocked else set())
        assert len(bench.told("hold")) == blocked

    def test_the_new_plan_lets_it_go_first(self, bench):
        bench.hold((2, 4), done=ALL)
        bench.board.plan_exposing = ALL
        bench.tick(bench.node(Replan))
        assert names(bench.board.new_plan) == ["release(2, 4)", *retraction((2, 5), *ALL)]

    def test_a_held_point_at_which_all_was_done_is_never_the_answer(self, bench):
        """A plan without actions would be one: the planner takes the region for exposed."""
        bench.hold((2, 4), done=ALL)
        bench.tick(bench.node(Replan))
        assert names(bench.board.new_plan)[0] == "release(2, 4)"
        assert (2, 4) in bench.planner.asked[-1].blocked
        assert bench.board.blocked == set()


class TestRehearsal:
    """The twin tries points in the planner's order before one is chosen."""

    @pytest.fixture
    def replan(self, bench):
        return bench.node(Replan, exposing=ALL, rehearse=12)

    def test_the_shortest_manoeuvres_that_expose_are_planned(self, bench, replan):
        bench.rehearse.shows = {((2, 4), FOLD): (0.9, 0.1), ((2, 4), ALL): (1.0, 0.1)}
        bench.tick(replan)
        assert names(bench.board.new_plan) == retraction((2, 4), *FOLD)
        assert bench.board.plan_exposing == FOLD
        assert bench.rehearse.asked == [((2, 4), PULL), ((2, 4), FOLD)]

    def test_points_that_show_too_little_are_skipped_but_not_blocked(self, bench, replan):
        bench.rehearse.shows = {((2, 5), MOVE): (0.85, 0.1), ((3, 4), PULL): (1.0, 0.1)}
        bench.tick(replan)
        assert names(bench.board.new_plan) == retraction((2, 5), *MOVE)
        assert bench.board.blocked == set()

    def test_a_retraction_with_too_much_force_shows_nothing(self, bench, replan):
        bench.rehearse.shows = {((2, 4), PULL): (1.0, 0.31), ((2, 5), PULL): (0.9, 0.29)}
        bench.tick(replan)
        assert names(bench.board.new_plan) == retraction((2, 5), *PULL)

    def test_if_none_exposes_the_best_one_is_tried(self, bench, replan):
        bench.rehearse.shows = {((2, 4), ALL): (0.3, 0.1), ((2, 5), FOLD): (0.6, 0.1)}
        bench.tick(replan)
        assert names(bench.board.new_plan) == retraction((2, 5), *FOLD)
        assert bench.board.plan_exposing == FOLD

    def test_it_tries_no_more_points_than_it_may(self, bench):
        bench.rehearse.shows = {((3, 4), PULL): (1.0, 0.1), ((2, 5), PULL): (0.5, 0.1)}
        bench.tick(bench.node(Replan, exposing=ALL, rehearse=2))
        assert names(bench.board.new_plan) == retraction((2, 5), *PULL)
        assert {point for point, _ in bench.rehearse.asked} == {(2, 4), (2, 5)}

    def test_blocked_points_are_not_rehearsed(self, bench, replan):
        bench.board.blocked.add((2, 4))
        bench.rehearse.shows = {((2, 5), PULL): (1.0, 0.1)}
        bench.tick(replan)
        assert bench.rehearse.asked == [((2, 5), PULL)]

    def test_a_held_point_is_rehearsed_only_with_what_was_done_to_it(self, bench, replan):
        bench.hold((2, 4), done=("pull", "move"))
        bench.rehearse.shows = {((2, 4), ALL): (1.0, 0.1)}
        bench.tick(replan)
        assert bench.rehearse.asked == [((2, 4), ALL)]
        assert names(bench.board.new_plan) == ["fold(2, 4)"]

    def test_what_was_done_already_is_no_plan(self, bench, replan):
        """In simulation pull and move may suffice; but they were done, and nothing is seen."""
        bench.hold((2, 4), done=MOVE)
        bench.rehearse.shows = {((2, 4), MOVE): (1.0, 0.1), ((2, 4), ALL): (0.2, 0.1)}
        assert bench.tick(replan) == Status.SUCCESS
        assert names(bench.board.new_plan) == ["fold(2, 4)"]

    def test_no_plan_at_all(self, bench, replan):
        bench.board.blocked.update(bench.planner.points)
        assert (bench.tick(replan), replan.code) == (Status.FAILURE, "impossible")
        assert bench.rehearse.asked == []


@pytest.mark.parametrize("parameters", [{"exposing": ()}, {"exposing": ["lift"]}, {"rehearse": -1}])
def test_parameters_that_make_no_sense_are_refused(bench, parameters):
    with pytest.raises(ValidationError):
        bench.node(Replan, **parameters)
