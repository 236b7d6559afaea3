"""The shipped trees, scenario by scenario: what is ticked, what is commanded, how it ends.

Tree, gate, perception and executive are the real ones. The tools are perfect, and the planner
retracts at (2, 4), then (2, 5), then (3, 4).
"""

from __future__ import annotations

import pytest

from defras_bt.executive.testing import NodeBench, bench_scene, plan_of
from defras_bt.planning.plan import Plan
from defras_bt.recording.operator_state import Act
from defras_sim.worlds.protocol import HOLD, JAW_OPEN_RAD
from tests.executive.stage import FORCE_TOO_HIGH_N, Stage, doing, jaws, leaves, moving, still, told

NAN = float("nan")
MONITORED = ("defras", "defras_paper")
TREES = (*MONITORED, "fras")
PHASES = ("reach", "pull", "move", "fold")
FULL_M_S = 0.015
TICK_S = 0.05


def on_stage(tree: str, **options: object) -> Stage:
    """Short ways; simulation says that pull, move and fold expose at every point, nothing less."""
    plain = bench_scene()
    short = {"reach_speed_m_s": 0.1, "pull_height_m": 0.02, "fold_distance_m": 0.03}
    scene = plain.model_copy(update={"motion": plain.motion.model_copy(update=short)})
    stage = Stage(tree, NodeBench(scene=scene, **options))
    for point in stage.bench.planner.points:
        stage.bench.rehearse.shows[point, ("pull", "move", "fold")] = (1.0, 0.1)
    return stage


@pytest.fixture(params=TREES)
def stage(request) -> Stage:
    return on_stage(request.param)


@pytest.fixture(params=MONITORED)
def monitored(request) -> Stage:
    return on_stage(request.param)


@pytest.mark.parametrize(
    ("tree", "metric"), [("defras", "local"), ("defras_paper", "median"), ("fras", None)]
)
def test_each_tree_listens_to_its_own_metric(tree, metric):
    assert on_stage(tree).board.metric == metric


def actions(stage: Stage) -> list[str]:
    return [
        event.data["action"]
        for record in stage.notes.records
        for event in record.events
        if event.kind == "action"
    ]


class TestNominal:
    """Nothing goes wrong."""

    def test_a_plan_is_carried_out_in_order_until_the_region_is_seen(self, stage):
        stage.until_doing("fold")
        stage.bench.world.visibility = 0.85
        last = stage.ticks(0.15)[-1]  # three readings confirm it
        assert stage.board.outcome == "goal"
        assert last.sent == HOLD
        assert doing(last) is None, "the fold was ticked beside the goal"
        assert actions(stage) == ["reach", "open", "grasp", "pull", "move"]
        assert stage.notes.told("replan") == []

    def test_the_goal_counts_whenever_it_is_seen(self, stage):
        stage.until_doing("reach")
        stage.bench.world.visibility = 0.8
        assert stage.ticks(0.15)[-1].sent == HOLD
        assert stage.board.outcome == "goal"

    def test_one_false_reading_ends_nothing(self, stage):
        stage.until_doing("pull")
        for seen in (1.0, 0.0, 1.0, 1.0, 0.0):
            stage.bench.world.visibility = seen
            stage.tick()
        assert stage.board.outcome is None

    def test_nothing_moves_before_monitoring_is_calibrated(self, monitored):
        first = monitored.until("calibrated", lambda r: monitored.board.rest_calibrated)
        assert all(still(record) for record in monitored.notes.records)
        assert all("act" not in leaves(record) for record in monitored.notes.records)
        assert leaves(first)["calibrate_rest"] == "SUCCESS"
        monitored.until_doing("reach")
        assert "calibrate_rest" not in leaves(monitored.tick())

    def test_the_preoperative_plan_comes_first_and_only_once(self):
        plan = plan_of((3, 4), ("reach", "open", "grasp", "pull"))
        stage = on_stage("defras", preoperative=plan)
        stage.until_doing("pull")
        assert stage.board.plan is plan
        assert stage.bench.planner.asked == []
        stage.until("a new plan", lambda r: stage.board.plan is not plan)
        assert (3, 4) in stage.board.blocked, "its retraction is over and showed nothing"
        assert stage.board.plan.actions[0].name == "release"

    def test_fras_has_no_preoperative_plan(self):
        plan = plan_of((3, 4), ("reach", "open", "grasp", "pull"))
        stage = on_stage("fras", preoperative=plan)
        stage.until_doing("reach")
        assert stage.board.plan is not plan

    def test_points_are_tried_one_after_the_other_until_none_is_left(self, stage):
        assert stage.until_over(120.0) == "not_reached"
        assert "every grasp point is blocked" in stage.board.outcome_reason
        assert stage.board.blocked == set(stage.bench.planner.points)
        assert actions(stage).count("fold") == 3
        assert len(stage.notes.told("replan")) == 2
        assert stage.notes.records[-1].sent == HOLD
        assert "psm1" in stage.board.grips, "the grip is kept"


class TestWarningState1:
    """Slower, and learning, while the plan goes on."""

    def test_the_rate_is_half_of_nominal_from_the_same_tick_on(self, monitored):
        monitored.until_doing("fold")
        monitored.warn(1)
        slow = monitored.ticks(0.5)
        assert [record.rate for record in slow] == [0.5] * 10
        assert [moving(r)["psm1"] for r in slow] == pytest.approx([FULL_M_S / 2] * 10)
        monitored.warn(0)
        after = monitored.tick()
        assert (after.rate, moving(after)["psm1"]) == (1.0, pytest.approx(FULL_M_S))

    def test_learning_happens_beside_the_motion(self, monitored):
        monitored.until_doing("fold")
        monitored.warn(1)
        first = monitored.tick()
        assert doing(first) == "fold"
        assert len(told([first], "learning")) == 1
        assert not monitored.slot.needs_plan
        assert monitored.notes.told("replan") == []

    def test_it_learns_again_only_after_5_mm(self, monitored):
        monitored.until_doing("fold")
        monitored.warn(1)
        records = monitored.ticks(1.5)
        learned_s = [r.time_s for r in records if told([r], "learning")]
        per_attempt_s = 0.005 / (FULL_M_S / 2)
        assert len(learned_s) == 3
        assert learned_s[1] - learned_s[0] == pytest.approx(per_attempt_s, abs=2 * TICK_S)

    def test_without_a_grip_there_is_nothing_to_learn(self, monitored):
        monitored.until_doing("reach")
        monitored.warn(1)
        assert [r.rate for r in monitored.ticks(0.5)] == [0.5] * 10
        assert monitored.bench.estimator.asked == []


class TestWarningState2:
    """Stop, learn, plan anew."""

    @pytest.mark.parametrize("phase", PHASES)
    def test_motion_stops_in_the_same_tick_and_the_plan_is_spent(self, monitored, phase):
        monitored.until_doing(phase)
        monitored.warn(2)
        stopped = monitored.tick()
        assert still(stopped)
        assert doing(stopped) is None, f"{phase} was ticked under warning state 2"
        assert leaves(stopped)["warning_below"] == "FAILURE"
        assert monitored.slot.code == "plan_interrupted"

    def test_it_learns_at_once_and_goes_on_with_a_new_plan(self, monitored):
        monitored.until_doing("move")
        old, belief = monitored.board.plan, monitored.bench.scene.attached
        monitored.bench.estimator.adopts = monitored.bench.monitor.heals = True
        monitored.warn(2)
        stopped = monitored.tick()
        assert len(told([stopped], "learning")) == 1
        assert (monitored.bench.context.scene.attached != belief).any()
        again = monitored.until_doing("move")
        assert monitored.board.plan is not old
        assert [action.name for action in monitored.board.plan.actions] == ["move", "fold"]
        assert len(monitored.notes.told("replan")) == 1
        assert again.time_s - stopped.time_s < 0.3
        assert monitored.board.blocked == set()

    def test_while_the_state_lasts_nothing_is_planned(self, monitored):
        monitored.until_doing("pull")
        asked = len(monitored.bench.planner.asked)
        monitored.warn(2)
        records = monitored.ticks(2.0)
        assert all(still(record) for record in records)
        assert len(monitored.bench.planner.asked) == asked

    def test_what_learning_does_not_explain_is_let_go_without_moving_the_tip(self, monitored):
        monitored.until_doing("move")
        monitored.warn(2)
        tip_m = monitored.bench.tip_m().copy()
        stopped = monitored.tick()
        assert jaws(stopped) == {"psm1": JAW_OPEN_RAD}
        monitored.until("let go", lambda r: not monitored.board.grips)
        assert (monitored.bench.tip_m() == tip_m).all()
        assert monitored.board.blocked == {(2, 4)}
        monitored.warn(0)
        monitored.until_doing("reach")
        assert monitored.board.plan.actions[0].point == (2, 5)

    def test_a_mismatch_that_survives_an_adopted_update_is_let_go_too(self, monitored):
        monitored.until_doing("move")
        monitored.bench.estimator.adopts = True
        monitored.warn(2)
        assert "psm1" in monitored.board.grips
        assert jaws(monitored.tick()) == {}, "learning gets its chance first"
        monitored.until("let go", lambda r: not monitored.board.grips, most_s=1.0)
        assert len(monitored.notes.told("learning")) == 1
        assert monitored.board.blocked == {(2, 4)}

    def test_with_nothing_held_a_human_is_asked_after_3_s(self, monitored):
        monitored.until_doing("reach")
        monitored.warn(2)
        started_s = monitored.bench.world.time_s
        assert monitored.until_over() == "human"
        assert monitored.notes.records[-1].time_s - started_s == pytest.approx(3.0, abs=0.11)
        assert "5.0 mm away" in monitored.board.outcome_reason


class TestWarningState3:
    """A human."""

    @pytest.mark.parametrize("phase", PHASES)
    def test_from_every_motion_in_the_same_tick(self, monitored, phase):
        monitored.until_doing(phase)
        held = dict(monitored.board.grips)
        monitored.warn(3)
        last = monitored.tick()
        assert monitored.board.outcome == "human"
        assert "7.0 mm away" in monitored.board.outcome_reason
        assert last.sent == HOLD
        assert doing(last) is None
        assert monitored.board.grips == held, "the grip is kept"

    @pytest.mark.parametrize("phase", ["open", "grasp"])
    def test_while_a_jaw_moves(self, monitored, phase):
        monitored.until(f"{phase} runs", lambda r: doing(r) == phase)
        monitored.warn(3)
        assert monitored.tick().sent == HOLD
        assert monitored.board.outcome == "human"


class TestForce:
    """Half speed at once, and after a moment the tissue is let go."""

    def test_over_its_threshold_the_rate_halves_in_the_same_tick(self, stage):
        stage.until_doing("fold")
        stage.bench.twin.feels_n = FORCE_TOO_HIGH_N
        slow = stage.tick()
        assert (slow.rate, moving(slow)["psm1"]) == (0.5, pytest.approx(FULL_M_S / 2))
        stage.bench.twin.feels_n = 0.1
        assert moving(stage.tick())["psm1"] == pytest.approx(FULL_M_S)
        assert stage.notes.told("replan") == []
        assert len(stage.notes.told("force")) == 1

    def test_it_is_let_go_after_half_a_second_and_another_point_is_used(self, stage):
        stage.until_doing("fold")
        stage.bench.twin.feels_n = FORCE_TOO_HIGH_N
        started_s = stage.bench.world.time_s
        first = stage.until("the jaw opens", lambda r: bool(jaws(r)))
        assert first.time_s - started_s == pytest.approx(0.5, abs=0.06)
        assert still(first)
        assert doing(first) is None
        assert jaws(first) == {"psm1": JAW_OPEN_RAD}
        stage.until("let go", lambda r: not stage.board.grips)
        stage.bench.twin.feels_n = 0.1
        assert stage.board.blocked == {(2, 4)}
        stage.until_doing("reach")
        assert stage.board.plan.actions[0].point == (2, 5)
        assert len(stage.notes.told("replan")) == 1

    def test_an_unknown_force_stops_in_the_same_tick(self, stage):
        stage.until_doing("pull")
        stage.bench.twin.feels_n = NAN
        stopped = stage.tick()
        assert still(stopped)
        assert doing(stopped) is None
        assert leaves(stopped)["force_accepted"] == "FAILURE"
        assert stage.slot.needs_plan

    def test_one_that_is_known_again_soon_costs_a_new_plan_only(self, stage):
        stage.until_doing("pull")
        stage.bench.twin.feels_n = NAN
        stage.ticks(0.3)
        stage.bench.twin.feels_n = 0.1
        stage.until_doing("pull", most_s=0.5)
        assert len(stage.notes.told("replan")) == 1
        assert stage.board.blocked == set()

    def test_one_that_stays_unknown_is_let_go(self, stage):
        stage.until_doing("pull")
        stage.bench.twin.feels_n = NAN
        first = stage.until("the jaw opens", lambda r: bool(jaws(r)), most_s=0.7)
        assert still(first)
        stage.until("let go", lambda r: not stage.board.grips, most_s=1.0)
        assert stage.board.blocked == {(2, 4)}

    def test_a_jaw_that_does_not_let_go_needs_a_human(self, stage):
        stage.until_doing("pull")
        stage.bench.twin.feels_n = FORCE_TOO_HIGH_N
        stage.bench.world.stuck.add("psm1")
        assert stage.until_over() == "human"
        assert "did not open" in stage.board.outcome_reason


class TestSensors:
    """Missing readings stop everything, jaws included."""

    @pytest.mark.parametrize("phase", ["reach", "pull"])
    @pytest.mark.parametrize("sensor", ["cloud_m", "visibility"])
    def test_motion_stops_in_the_same_tick(self, stage, phase, sensor):
        stage.until_doing(phase)
        setattr(stage.bench.world, sensor, None)
        stopped = stage.tick()
        assert stopped.sent == HOLD
        assert doing(stopped) is None
        assert leaves(stopped)["wait"] == "RUNNING"

    def test_after_3_s_a_human_is_asked_and_told_why(self, stage):
        stage.until_doing("pull")
        stage.bench.world.cloud_m = None
        started_s = stage.bench.world.time_s
        assert stage.until_over() == "human"
        assert "cloud" in stage.board.outcome_reason
        assert stage.notes.records[-1].time_s - started_s == pytest.approx(3.0, abs=0.06)
        assert all(record.sent == HOLD for record in stage.notes.records[-50:])
        assert "psm1" in stage.board.grips

    def test_back_in_time_the_operation_goes_on_with_a_new_plan(self, stage):
        stage.until_doing("pull")
        cloud_m, stage.bench.world.cloud_m = stage.bench.world.cloud_m, None
        stage.ticks(2.0)
        assert len(stage.notes.told("replan")) == 0
        stage.bench.world.cloud_m = cloud_m
        stage.until_doing("pull", most_s=0.5)
        assert len(stage.notes.told("replan")) == 1

    def test_the_wait_starts_anew_with_every_gap(self, stage):
        stage.until_doing("pull")
        cloud_m = stage.bench.world.cloud_m
        for _ in range(2):
            stage.bench.world.cloud_m = None
            stage.ticks(2.0)
            stage.bench.world.cloud_m = cloud_m
            stage.tick()
        assert stage.board.outcome is None


class TestOperator:
    """The operator has the last word."""

    @pytest.mark.parametrize("phase", PHASES)
    def test_a_stop_holds_in_the_same_tick(self, stage, phase):
        stage.until_doing(phase)
        stage.operator(Act.STOP, "the pedal")
        last = stage.tick()
        assert last.sent == HOLD
        assert doing(last) is None
        assert stage.board.outcome == "human"
        assert stage.board.outcome_reason == "the operator asked to stop: the pedal"
        assert stage.board.outcome_cause.code == "stopped"

    def test_a_stop_counts_more_than_the_goal(self, stage):
        stage.until_doing("fold")
        stage.operator(Act.STOP)
        stage.bench.world.visibility = 1.0
        stage.tick()
        assert stage.board.outcome == "human"

    def test_a_plan_that_is_refused_asks_a_human_without_motion(self):
        for tree in TREES:
            asked = 0

            def refuse(plan: Plan) -> bool:
                nonlocal asked
                asked += 1
                return False

            stage = on_stage(tree, approve=refuse, preoperative=plan_of((2, 4)))
            assert stage.until_over() == "human"
            assert "did not approve" in stage.board.outcome_reason
            assert asked == 1, "a refused plan is no reason to ask about the next one"
            assert all(still(record) for record in stage.notes.records)


class TestFras:
    """The baseline knows neither monitoring nor learning."""

    @pytest.mark.parametrize("state", [1, 2, 3])
    def test_warnings_change_nothing(self, state):
        stage = on_stage("fras")
        stage.warn(state)
        stage.until_doing("fold")
        assert {record.rate for record in stage.notes.records} == {1.0}
        assert stage.bench.estimator.asked == []
        assert stage.notes.told("warning") == []
        assert not stage.board.rest_calibrated
        assert stage.board.warning_state is None


class TestGrasp:
    """A grasp that gets hold of nothing."""

    def test_its_point_is_blocked_and_another_one_used(self, stage):
        stage.bench.world.slippery = True
        stage.until("a point is blocked", lambda r: bool(stage.board.blocked))
        stage.bench.world.slippery = False
        stage.until_doing("pull")
        assert stage.board.blocked == {(2, 4)}
        assert stage.board.grips["psm1"].point == (2, 5)

    def test_tissue_that_slips_off_is_reached_for_again(self, stage):
        stage.until_doing("move")
        stage.bench.world.tools["psm1"].grasped = False
        stage.until_doing("reach", most_s=0.5)
        assert stage.board.plan.actions[0].name == "reach"
        stage.until_doing("move")
