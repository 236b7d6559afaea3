"""The executive owns the clock, stops on every exception, and leaves a record of how it ended."""

from __future__ import annotations

import json
from collections.abc import Callable

import numpy as np
import pytest
from py_trees.common import Status

from defras_bt.executive.executive import ExecutiveFailed
from defras_bt.executive.testing import EPSILON_N, NodeBench, plan_of
from defras_bt.recording.record import RunInfo
from defras_bt.recording.summary import SummaryRecorder, read_run_json
from defras_bt.recording.versions import versions
from defras_sim.worlds.protocol import HOLD, Command
from tests.executive.stage import Stage, leaves, moving, still


def run(stage: Stage) -> ExecutiveFailed:
    """Run to the failure that the test prepared."""
    with pytest.raises(ExecutiveFailed) as caught:
        stage.executive.run()
    return caught.value


def at_pull(**options: object) -> Stage:
    """The tissue is held and on its way up."""
    stage = Stage("fras", NodeBench(**options))
    stage.until_doing("pull")
    return stage


def broken_world(where: str) -> Callable[[Stage], None]:
    def breaks(stage: Stage) -> None:
        stage.bench.world.broken[where] = RuntimeError("the cable is cut")

    return breaks


def broken_twin(stage: Stage) -> None:
    stage.bench.twin.broken = RuntimeError("the cable is cut")


def broken_leaf(stage: Stage) -> None:
    def update() -> Status:
        raise RuntimeError("the cable is cut")

    stage.slot.current_child.update = update


def broken_planner(stage: Stage) -> None:
    def plan(situation, attached, *, required_grasp=None):
        raise RuntimeError("the cable is cut")

    stage.bench.planner.plan = plan
    stage.bench.world.tools["psm1"].grasped = False


def true_force_unreadable(stage: Stage) -> None:
    def true_force_n():
        raise RuntimeError("the cable is cut")

    stage.bench.world.true_force_n = true_force_n


BREAKS = {
    "world.observe": broken_world("observe"),
    "world.step": broken_world("step"),
    "the twin": broken_twin,
    "a leaf": broken_leaf,
    "the planner": broken_planner,
    "the true force": true_force_unreadable,
}


class TestExceptions:
    """Motion zero, the grip kept, the reason in the last record."""

    @pytest.mark.parametrize("what", BREAKS)
    def test_motion_stops_and_the_last_record_says_why(self, what):
        stage = at_pull()
        BREAKS[what](stage)
        failure = run(stage)
        assert str(failure) == "RuntimeError: the cable is cut"
        assert isinstance(failure.__cause__, RuntimeError)
        assert stage.bench.world.sent[-1] == HOLD
        last = stage.notes.records[-1]
        assert last.sent == HOLD
        (event,) = last.events
        assert (event.kind, event.level) == ("error", "error")
        assert "the cable is cut" in event.sentence
        assert (stage.board.outcome, stage.board.outcome_reason) == ("error", str(failure))

    def test_what_the_broken_tick_told_before_it_broke_is_recorded_once(self):
        stage = at_pull()

        def update() -> Status:
            stage.board.tell("hold", "Something feels wrong.")
            raise RuntimeError("the cable is cut")

        stage.slot.current_child.update = update
        run(stage)
        assert [event.kind for event in stage.notes.records[-1].events] == ["hold", "error"]
        assert stage.notes.told("hold") == ["Something feels wrong."]

    def test_the_last_record_has_the_inputs_of_the_tick_that_broke(self):
        stage = at_pull()
        broken_leaf(stage)
        run(stage)
        before, last = stage.notes.records[-2:]
        assert last.time_s == stage.board.inputs.time_s > before.time_s
        assert last.observation is stage.board.inputs.observation
        assert last.events[-1].time_s == last.time_s
        assert (last.true_force_n, last.true_surface) == (None, None)

    def test_ticks_and_times_of_the_records_go_on_to_the_end(self):
        stage = at_pull()
        broken_twin(stage)
        run(stage)
        records = stage.notes.records
        assert [record.tick for record in records] == list(range(len(records)))
        assert (np.diff([record.time_s for record in records]) >= 0).all()

    def test_a_world_that_takes_no_order_to_stop_either(self):
        stage = at_pull()
        broken_world("command")(stage)
        failure = run(stage)
        assert str(failure) == "RuntimeError: the cable is cut"
        (event,) = stage.notes.records[-1].events
        assert "did not take the order to stop" in event.sentence
        assert stage.board.outcome == "error"

    def test_a_failure_before_the_first_record_is_recorded(self):
        stage = Stage("fras")
        broken_world("observe")(stage)
        run(stage)
        (record,) = stage.notes.records
        assert record.sent == HOLD
        assert "the cable is cut" in record.events[0].sentence

    def test_a_tree_without_plan_slot_must_not_plan(self, tmp_path):
        file = tmp_path / "planner.yaml"
        file.write_text("name: planner\ntree: {Replan: {}}\n", encoding="utf-8")
        failure = run(Stage(file))
        assert "no plan_slot" in str(failure)

    def test_what_was_recorded_stays_readable(self, tmp_path):
        """As ``operate`` does it: the recorders are finished although the run broke."""
        numbers = SummaryRecorder(tmp_path / "run.json")
        stage = Stage("fras", beside=[numbers])
        stage.recorder.start(info(stage))
        stage.until_doing("pull")
        broken_twin(stage)
        run(stage)
        stage.recorder.finish(numbers.summary(stage.board.outcome, 1.0))
        file = read_run_json(tmp_path / "run.json")
        assert (file.outcome, file.actions) == ("error", 3)
        assert stage.notes.finished is not None
        assert json.loads((tmp_path / "run.json").read_text())["outcome"] == "error"


def info(stage: Stage) -> RunInfo:
    scene = stage.bench.scene
    return RunInfo(
        scene=scene,
        scene_file="bench.yaml",
        actual=scene,
        actual_file=None,
        world="bench",
        tree=stage.executive.tree.name,
        seed=0,
        metric="local",
        force_threshold_n=EPSILON_N,
        tree_paths=stage.executive.tree.kinds(),
        versions=versions(),
        believed=scene.attached,
    )


class TestEnds:
    """Every run ends, and holds from then on."""

    def test_time_is_over(self):
        stage = Stage("fras", max_time_s=1.0)
        stage.executive.run()
        assert stage.board.outcome == "not_reached"
        assert "time is over" in stage.board.outcome_reason
        last = stage.notes.records[-1]
        assert last.time_s == pytest.approx(1.0)
        assert last.proposed.arms, "the reach was still under way"
        assert last.sent == stage.bench.world.sent[-1] == HOLD
        assert stage.notes.told("end") == ["Stopped after 1 s without the goal."]

    def test_a_goal_in_the_last_tick_counts(self):
        stage = Stage("fras", max_time_s=1.0)
        stage.ticks(0.9)
        stage.bench.world.visibility = 0.9
        stage.executive.run()
        assert stage.board.outcome == "goal"

    def test_a_run_that_ended_does_not_tick_again(self):
        stage = Stage("fras", max_time_s=0.2)
        stage.executive.run()
        records = len(stage.notes.records)
        stage.executive.run()
        assert len(stage.notes.records) == records


class TestRecords:
    """What a record says of its tick."""

    def test_every_tick_is_recorded_with_what_left_the_gate(self):
        stage = at_pull()
        records = stage.notes.records
        assert [record.tick for record in records] == list(range(len(records)))
        assert [record.sent for record in records] == stage.bench.world.sent

    def test_statuses_of_all_nodes_also_of_those_that_were_pre_empted(self):
        stage = at_pull()
        running = stage.notes.records[-1]
        stage.bench.twin.feels_n = float("nan")
        stopped = stage.tick()
        assert set(stopped.node_status) == set(running.node_status)
        (pull,) = [path for path in running.node_status if path.endswith("_pull_psm1")]
        assert (running.node_status[pull], stopped.node_status[pull]) == ("RUNNING", "")
        assert "pull" in stopped.node_message[pull], "its last word is kept"
        assert leaves(stopped)["force_accepted"] == "FAILURE"
        assert stopped.node_status["fras/operate"] == "FAILURE"
        assert stopped.node_status["fras/give_up"] == ""

    def test_a_branch_that_is_pre_empted_and_ticked_in_one_tick_keeps_its_status(self):
        """The goal takes over from an action that was running the tick before."""
        stage = at_pull()
        stage.bench.world.visibility = 1.0
        last = stage.ticks(0.15)[-1]
        assert leaves(last)["finish"] == "SUCCESS"
        assert last.node_status["fras/operate"] == ""
        assert last.node_status["fras/operate/act"] == ""

    def test_the_plan_and_the_step_that_is_carried_out(self):
        stage = at_pull()
        last = stage.notes.records[-1]
        assert last.plan is stage.board.plan
        assert last.action == last.plan.actions[last.plan_step]
        assert last.action.name == "pull"

    def test_while_a_guard_holds_the_plan_back_no_action_is_carried_out(self):
        stage = at_pull()
        stage.bench.world.cloud_m = None
        record = stage.ticks(1.0)[-1]
        assert "cloud" in str(record.node_message)
        assert (record.plan_step, record.action) == (None, None)

    def test_a_new_plan_is_carried_out_from_the_next_tick_on(self):
        stage = Stage("fras")
        first = stage.tick()
        assert still(first)
        assert first.plan is None
        second = stage.tick()
        assert second.plan is stage.board.plan
        assert any(moving(second).values())

    def test_the_belief_is_the_one_after_the_tick(self):
        stage = Stage("defras")
        stage.until_doing("pull")
        stage.bench.estimator.adopts = True
        stage.bench.monitor.warn(1)
        record = stage.until("something was learned", lambda r: bool(stage.bench.estimator.asked))
        np.testing.assert_array_equal(record.believed, ~stage.bench.scene.attached)

    @pytest.mark.parametrize(("state", "what"), [(1, "learning"), (2, "plan anew"), (3, "human")])
    def test_a_rising_warning_state_is_told_once(self, state, what):
        stage = Stage("defras")
        stage.until_doing("pull")
        stage.bench.monitor.warn(state)
        stage.ticks(0.2)
        (sentence,) = stage.notes.told("warning")
        assert f"Warning state {state}" in sentence
        assert what in sentence


class TestTwoExecutives:
    """Two operations in one process share nothing."""

    def test_interleaved_they_do_what_they_do_alone(self):
        def commands(stage: Stage) -> list[list[tuple[str, list[float], float | None]]]:
            return [
                [(arm, list(c.linear_m_s), c.jaw_rad) for arm, c in sent.arms.items()]
                for sent in stage.bench.world.sent
            ]

        def scenario() -> tuple[Stage, Stage]:
            plan = plan_of((3, 4), ("reach", "open", "grasp", "pull", "fold"))
            return Stage("defras", NodeBench(preoperative=plan)), Stage("defras_paper")

        alone = scenario()
        for stage in alone:
            stage.ticks(6.0)
        together = scenario()
        for _ in range(120):
            for stage in together:
                stage.tick()
        for one, other in zip(alone, together, strict=True):
            assert commands(one) == commands(other)
        assert alone[0].board.preoperative_used
        assert not alone[1].board.preoperative_used

    def test_one_that_breaks_leaves_the_other_alone(self):
        broken, whole = Stage("fras"), Stage("fras")
        for stage in (broken, whole):
            stage.until_doing("pull")
        broken_twin(broken)
        run(broken)
        assert any(moving(whole.tick()).values())
        assert whole.board.outcome is None


def test_the_operator_is_shown_each_plan_before_anything_moves():
    shown = []

    def approve(plan):
        shown.append((plan, list(stage.bench.world.sent)))
        return True

    stage = Stage("fras", NodeBench(approve=approve))
    stage.until_doing("reach")
    ((plan, sent),) = shown
    assert plan is stage.board.plan
    assert all(command == Command() for command in sent)
