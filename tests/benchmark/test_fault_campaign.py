"""A small fault campaign, and the judge against commands that are made up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joblib import Parallel, delayed

from defras_bt.benchmark.fault_cases import drawn_fault
from defras_bt.benchmark.fault_judge import Moment, Witness, late_motion, lost_recordings, verdict
from defras_bt.benchmark.faults import FaultRun, by_kind, by_run, fault_run, passed
from defras_bt.faults.faults import KINDS, Faults
from defras_bt.faults.system import Killed
from defras_bt.planning.preparation import Preparation

# As rehearsed once for the campaign's patient; without a plan, so that nothing is rehearsed here.
PREPARED = Preparation(0.86, None)


class TestJudge:
    """The judge knows only what was commanded and when it had to stop."""

    @pytest.mark.parametrize(
        ("moving", "trips", "expected"),
        [
            ("....", "xxxx", (0, 0)),
            ("mmmm", "....", (0, 0)),
            ("mmm.", ".xxx", (2, 0)),
            ("mmmm", ".xxx", (2, 1)),
            ("m...mm", ".xx..x", (1, 0)),
            ("mm.m", "xxxx", (2, 1)),
        ],
    )
    def test_late_motion(self, moving, trips, expected) -> None:
        assert late_motion([c == "m" for c in moving], [c == "x" for c in trips]) == expected

    def test_motion_that_is_wrong_by_itself(self) -> None:
        def judged(*moments: Moment) -> int:
            witness = Witness()
            witness.moments, witness.reason = list(moments), "done"
            return verdict(witness, [()] * len(moments), []).wrong

        fine = Moment(0.0, True, False, False)
        assert judged(fine, fine) == 0
        assert judged(fine, Moment(0.0, True, True, False)) == 1
        slipping = Moment(0.0, True, False, True)
        assert judged(fine, slipping, fine) == 0, "nobody can know in the tick of the slip"
        assert judged(fine, slipping, slipping) == 1

    def test_what_cannot_be_read_is_lost(self, tmp_path) -> None:
        (tmp_path / "run.rrd").write_bytes(b"not a timeline")
        (tmp_path / "run.json").write_text("{", encoding="utf-8")
        needed = dict.fromkeys(("run.rrd", "run.json", "recording.mcap"), 1.0)
        assert len(lost_recordings(tmp_path, needed)) == 3


@pytest.mark.parametrize("kind", KINDS)
def test_faults_are_drawn_from_their_seed_alone(kind: str) -> None:
    drawn = [drawn_fault(kind, seed) for seed in range(20)]
    assert drawn == [drawn_fault(kind, seed) for seed in range(20)]
    assert len({faults.faults[0].start_s for faults in drawn}) == 20
    lasting = [faults.faults[0].duration_s is None for faults in drawn]
    assert 0 < np.mean(lasting) < 1, "some end, some do not"


@pytest.mark.parametrize(
    ("kind", "outcomes"),
    [
        ("not_a_number", {"goal", "human"}),
        ("frozen", {"goal", "human"}),
        ("grasp_lost", {"goal", "human", "not_reached"}),
        ("node_raises", {"error"}),
        ("world_lost", {"error"}),
        ("disk_full", {"goal", "human"}),
        ("killed", {"killed"}),
    ],
)
def test_a_small_campaign(kind: str, outcomes: set[str]) -> None:
    run = fault_run(kind, 0, PREPARED, "fras")
    found = run.verdict
    assert (found.late, found.wrong, found.lost, found.broke) == (0, 0, (), "")
    assert found.outcome in outcomes
    assert found.reason
    assert passed([run])


def test_a_guard_that_does_not_work_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """The campaign must be able to fail: here nothing that is missing stops anything."""
    monkeypatch.setattr("defras_bt.executive.perception.stale", lambda sensed, scene: {})
    run = fault_run("missing", 5, PREPARED, "fras")
    assert run.verdict.late > 0
    assert not passed([run])
    assert by_kind([run])[-1]["motion later than one tick"] == run.verdict.late


def _breaks(*_: object) -> None:
    raise KeyError("a mistake in the program")


@pytest.mark.parametrize("kind", ["frozen", "node_raises", "world_lost"])
def test_a_tick_that_breaks_by_itself_fails_the_campaign(
    monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    """Also where the fault itself may end the run: the exception is not the fault's."""
    monkeypatch.setattr("defras_bt.executive.gate.CommandGate.check", _breaks)
    run = fault_run(kind, 0, PREPARED, "fras")
    assert run.verdict.outcome == "error"
    assert "KeyError: 'a mistake in the program'" in run.verdict.broke
    assert by_kind([run])[-1]["uncaught exceptions"] == 1
    assert not passed([run])


def test_a_recorder_that_breaks_by_itself_fails_the_campaign(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """In the run's numbers no fault has a part, and all else may go as it should."""
    monkeypatch.setattr("defras_bt.benchmark.fault_judge.Witness.finish", _breaks)
    monkeypatch.setattr("defras_bt.benchmark.faults.MAX_TIME_S", 1.0)
    run = fault_run("node_raises", 0, PREPARED, "fras")
    assert "KeyError: 'a mistake in the program'" in run.verdict.broke
    assert not passed([run])


@pytest.mark.parametrize(
    ("kind", "outcome", "fine"),
    [
        ("frozen", "human", True),
        ("frozen", "error", False),
        ("frozen", "none", False),
        ("node_hangs", "error", True),
        ("killed", "killed", True),
        ("killed", "goal", False),
    ],
)
def test_a_run_ends_only_as_its_fault_allows(kind: str, outcome: str, fine: bool) -> None:
    witness = Witness()
    witness.outcome, witness.reason = outcome, "done"
    judged = replace(verdict(witness, [], []), tripped=True)
    assert passed([FaultRun(kind, 0, 1.0, judged)]) is fine


def test_tables_count_what_was_judged() -> None:
    witness = Witness()
    witness.outcome, witness.reason, witness.moments = "goal", "done", []
    good = FaultRun("frozen", 1, 2.0, verdict(witness, [], []))
    bad = FaultRun("noisy", 2, 3.0, verdict(witness, [("x",)], ["run.rrd: gone"], "KeyError: 1"))
    frozen, noisy, everything = by_kind([bad, good])
    assert (frozen["fault"], noisy["fault"], everything["fault"]) == ("frozen", "noisy", "all")
    assert (everything["runs"], everything["goal"]) == (2, 2)
    assert (noisy["lost recordings"], noisy["uncaught exceptions"]) == (1, 1)
    assert [line["seed"] for line in by_run([bad, good])] == [1, 2]
    assert passed([good])
    assert not passed([good, bad])


def test_a_run_that_ends_before_it_would_be_killed_is_judged_by_its_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    late = Faults((Killed(start_s=250.0),))
    monkeypatch.setattr("defras_bt.benchmark.faults.drawn_fault", lambda *_: late)
    run = fault_run("killed", 0, PREPARED, "fras")
    assert run.verdict.outcome in ("goal", "human", "not_reached")
    assert (run.verdict.lost, run.verdict.broke) == ((), "")
    assert passed([run])


def test_a_run_is_killed_in_a_worker_too() -> None:
    (run,) = Parallel(n_jobs=2)([delayed(fault_run)("killed", 0, PREPARED, "fras")])
    assert run.verdict.outcome == "killed"
    assert passed([run])
