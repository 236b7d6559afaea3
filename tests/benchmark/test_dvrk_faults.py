"""The judge of the dVRK's faults, on records written by hand."""

import json
from pathlib import Path

import numpy as np
import pytest

from defras_bt.benchmark.dvrk_fault_cases import KINDS, DvrkFault, drawn, known_after_s
from defras_bt.benchmark.dvrk_fault_judge import (
    Countdown,
    DvrkVerdict,
    fault_times,
    first_picture_s,
    grips,
    last_motion_s,
    moving,
    read_facts,
)
from defras_bt.benchmark.dvrk_faults import DvrkRun, by_kind, by_run, key_of, row_of, run_of
from defras_bt.benchmark.own_process import ProcessFailed, in_own_process
from defras_bt.benchmark.row_store import RowStore
from defras_bt.dvrk.settings import Limits
from defras_bt.dvrk.stand_in.faults import fault_of

GOAL = {"event": "goal", "command": "servo_cp", "arm": "psm1", "jaw": 0.0}
FACTS = [
    {**GOAL, "time_s": 1.00, "way_m": 0.0003},
    {**GOAL, "time_s": 1.01, "way_m": 0.0},
    {"event": "arm", "time_s": 1.01, "arm": "psm1", "grasped": True},
    {"event": "fault", "time_s": 1.015, "begins": True, "fault": "paused"},
    {**GOAL, "time_s": 1.02, "way_m": 0.0003},
    {**GOAL, "time_s": 1.03, "way_m": 0.0003, "refused": "the arm is PAUSED"},
    {"event": "arm", "time_s": 1.10, "arm": "psm1", "grasped": True},
    {"event": "fault", "time_s": 9.0, "begins": False, "fault": "paused"},
    {"event": "arm", "time_s": 9.5, "arm": "psm1", "grasped": False},
]


def test_only_set_points_that_lead_elsewhere_and_were_taken_are_motion():
    assert moving(FACTS) == [1.0, 1.02]
    assert last_motion_s(moving(FACTS), 1.015) == 1.02
    assert last_motion_s(moving(FACTS), 1.5) is None
    assert fault_times(FACTS) == (1.015, 9.0)


def test_a_grip_counts_as_lost_only_while_the_fault_may_be_blamed():
    assert grips(FACTS, 1.015, 8.0) == (True, False)
    assert grips(FACTS, 1.015, 10.0) == (True, True)
    assert grips(FACTS, 0.5, 10.0) == (False, False)


def test_a_wrong_picture_is_known_when_it_leaves():
    pictures = [
        {"time_s": 1.0, "faults": []},
        {"time_s": 1.1, "faults": ["millimetres"]},
        {"time_s": 1.2, "faults": ["millimetres"]},
    ]
    assert first_picture_s(pictures, "millimetres") == 1.1
    assert first_picture_s(pictures, "frozen") == np.inf


def test_a_record_cut_off_by_a_kill_is_read_to_its_last_whole_line(tmp_path: Path):
    file = tmp_path / "witness.jsonl"
    file.write_text("".join(json.dumps(fact) + "\n" for fact in FACTS) + '{"event": "go')
    assert read_facts(file) == FACTS


def test_every_kind_can_be_drawn_and_ordered():
    limits = Limits()
    for kind in KINDS:
        for seed in range(12):
            fault = drawn(kind, seed)
            assert drawn(kind, seed) == fault
            assert (fault.entry is None) is (fault.killed is not None)
            if fault.entry is not None:
                assert fault_of({**fault.entry, "duration_s": 2.0}).duration_s == 2.0
            known = known_after_s(fault, limits, 0.5)
            assert known is None or 0.0 <= known <= 0.5
    assert known_after_s(drawn("duplicated", 0), limits, 0.5) is None
    assert known_after_s(drawn("paused", 0), limits, 0.5) == 0.0
    with pytest.raises(KeyError):
        drawn("earthquake", 0)


def goal(way_m: float) -> dict:
    return {"event": "goal", "time_s": 1.0, "command": "servo_cp", "way_m": way_m}


def test_half_of_the_faults_wait_for_a_grasp_before_they_count_motion():
    assert [drawn("paused", seed).held for seed in range(4)] == [False, True, False, True]
    taken = {"event": "arm", "time_s": 1.0, "arm": "psm1", "grasped": True}
    story = [goal(1e-3), goal(1e-3), taken, goal(0.0), goal(1e-3), goal(1e-3)]
    free, held = (Countdown(DvrkFault("paused", 0, 2, held=held)) for held in (False, True))
    assert [free.over(fact) for fact in story].index(True) == 1
    assert [held.over(fact) for fact in story].index(True) == 5


def verdict(**changes) -> DvrkVerdict:
    usual = {
        "outcome": "human", "reason": "PSM1 is PAUSED", "begun_s": 3.0, "known_s": 3.0,
        "last_s": 3.01, "late_ms": 10.0, "held": True, "grip_lost": False, "lost": (),
        "restarts": "",
    }  # fmt: skip
    return DvrkVerdict(**{**usual, **changes})


@pytest.mark.parametrize(
    ("changes", "passes"),
    [
        ({}, True),
        ({"late_ms": 51.0}, False),
        ({"grip_lost": True}, False),
        ({"reason": ""}, False),
        ({"lost": ("run.json: gone",)}, False),
        ({"restarts": "nobody answers"}, False),
        ({"broke": "KeyError"}, False),
    ],
)
def test_what_counts_against_a_run(changes, passes):
    assert verdict(**changes).passed is passes


def test_tables_count_what_had_to_stop_and_what_broke():
    runs = [
        DvrkRun("paused", 0, verdict()),
        DvrkRun("paused", 1, verdict(late_ms=80.0)),
        DvrkRun("duplicated", 0, verdict(known_s=None, outcome="goal")),
        DvrkRun("lost", 0, None, "it took too long"),
    ]
    lines = {line["fault"]: line for line in by_kind(runs)}
    assert lines["paused"]["had to stop"] == 2
    assert lines["paused"]["worst ms"] == 80.0
    assert lines["paused"]["later than 50 ms"] == 1
    assert lines["duplicated"]["had to stop"] == 0
    assert lines["all"]["passed"] == 2
    assert lines["all"]["broke"] == 1
    assert [line["passed"] for line in by_run(runs)] == [True, False, True, False]


@pytest.mark.parametrize(
    "run",
    [
        DvrkRun("paused", 3, verdict(lost=("run.json: gone",))),
        DvrkRun("duplicated", 0, verdict(known_s=None, begun_s=np.inf, last_s=None)),
        DvrkRun("lost", 1, None, "it took too long"),
    ],
)
def test_a_run_on_disk_is_the_run_it_was(run: DvrkRun, tmp_path: Path):
    file = tmp_path / "rows.jsonl"
    RowStore(file, "faults", resume=False).add(row_of(run))
    (row,) = RowStore(file, "faults", resume=True).rows
    assert run_of(row) == run
    assert row.key == key_of(run.kind, run.seed)


def doubled(number: int) -> int:
    if number < 0:
        raise ValueError("less than nothing")
    return 2 * number


def test_a_function_runs_in_a_process_of_its_own():
    assert in_own_process(doubled, 21, within_s=60.0) == 42
    with pytest.raises(ProcessFailed, match="less than nothing"):
        in_own_process(doubled, -1, within_s=60.0)
