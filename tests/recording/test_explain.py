"""A tick explained from its record: every sentence is what a node said, from root to cause."""

from __future__ import annotations

import pytest

from defras_bt.executive.executive import ExecutiveFailed
from defras_bt.executive.reasons import Code
from defras_bt.executive.testing import EPSILON_N
from defras_bt.recording.explain import Explanation, explain, spoken
from defras_bt.recording.moment import moment_of
from tests.executive.stage import Stage


@pytest.fixture
def stage() -> Stage:
    stage = Stage("defras")
    for point in stage.bench.planner.points:
        stage.bench.rehearse.shows[point, ("pull", "move", "fold")] = (1.0, 0.1)
    return stage


def explained(stage: Stage) -> Explanation:
    return explain(moment_of(stage.notes.records[-1], dict(stage.executive.tree.kinds())))


def test_a_plan_under_way(stage: Stage) -> None:
    stage.until_doing("pull")
    said = explained(stage)
    assert said.stop == ""
    assert said.decided == "PSM1: pull, tissue held at (2, 4) [moving]."
    assert said.chain[0].startswith('"defras" chose "operate"; before it, these did not apply: "')
    assert "the warning state is 0" in said.chain[1]
    assert said.chain[2] == 'The plan was carried out at "pull psm1 (step 4)".'
    assert said.chain[-1] == '"pull psm1 (step 4)": PSM1: pull, tissue held at (2, 4) [moving].'


def test_a_human_is_asked_because_the_model_is_lost(stage: Stage) -> None:
    stage.until_doing("pull")
    stage.warn(3)
    stage.tick()
    said = explained(stage)
    assert said.decided == (
        "The operation ended. The tissue is 7.0 mm away from where the model expects it [warned]."
    )
    assert said.chain[:2] == (
        '"defras" chose "human"; before it, these did not apply: '
        '"operator" (the operator neither paused nor took over).',
        '"human" came to its end with "ask human", after "needed" (the warning state is 3).',
    )


def test_a_force_that_is_too_high_names_its_guard(stage: Stage) -> None:
    stage.until_doing("pull")
    stage.bench.twin.feels_n = 2 * EPSILON_N
    stage.until("it lets go", lambda r: r.cause is not None and r.cause.code == Code.OPENING)
    said = explained(stage)
    assert said.decided == "Letting go of the tissue [opening]."
    assert said.stop.startswith(
        "No plan was carried out: the force is 0.60 N, over its threshold of 0.30 N for 0.5"
    )
    assert said.stop.endswith("s [force_too_high].")
    assert '"operate" (the force is 0.60 N' in said.chain[0], "what failed before is named"


def test_the_same_text_stands_in_the_log(stage: Stage) -> None:
    stage.until_doing("pull")
    stage.bench.twin.feels_n = 2 * EPSILON_N
    record = stage.until("it lets go", lambda r: any(e.kind == "why" for e in r.events))
    (event,) = [event for event in record.events if event.kind == "why"]
    said = explained(stage)
    assert event.sentence == said.summary
    assert event.data["chain"] == list(said.chain)
    stage.ticks(1.0)
    assert len(stage.notes.told("why")) == 1, "told once, not every tick"


def test_an_end_short_of_the_goal_is_told_with_its_reason(stage: Stage) -> None:
    stage.until_doing("reach")
    stage.bench.world.cloud_m = None
    stage.until_over()
    assert stage.notes.told("why")[-1].startswith("The operation ended. ")
    assert "[stale]" in stage.notes.told("why")[-1]


def test_a_goal_needs_no_excuse(stage: Stage) -> None:
    stage.until_doing("reach")
    stage.bench.world.visibility = 1.0
    stage.until_over()
    assert stage.notes.told("why") == []
    assert explained(stage).decided.endswith("the goal is reached [goal].")


def test_when_nothing_is_left(stage: Stage) -> None:
    stage.board.blocked.update(stage.bench.planner.points)
    stage.until_over()
    said = explained(stage)
    assert "[impossible]" in said.decided
    assert said.text.count("\n") == len(said.chain)


@pytest.mark.parametrize(
    ("name", "expected"),
    [("3_grasp_psm1", "grasp psm1 (step 3)"), ("warning_below", "warning below"), ("3", "3")],
)
def test_names_are_spoken(name: str, expected: str) -> None:
    assert spoken(name) == expected


def test_where_the_executive_broke_no_node_is_blamed(stage: Stage) -> None:
    stage.until_doing("pull")
    stage.bench.world.broken["observe"] = RuntimeError("the cable is cut")
    with pytest.raises(ExecutiveFailed):
        stage.executive.run()
    said = explained(stage)
    assert "the cable is cut" in said.decided
    assert (said.stop, said.chain) == ("", ())
