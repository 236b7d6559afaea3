"""Twin, planner, nodes and recorders that go wrong when a fault file says so."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
import pytest

from defras_bt.executive.deadline import interrupting
from defras_bt.executive.executive import ExecutiveFailed
from defras_bt.executive.testing.world import BenchWorld
from defras_bt.faults.faults import FaultInjection, Faults
from defras_bt.faults.services import (
    FaultyPlanner,
    FaultyTwin,
    FullDisk,
    NodeBreaker,
)
from defras_bt.faults.system import (
    DiskFull,
    InjectedFault,
    NodeHangs,
    NodeRaises,
    PlannerTimesOut,
    TwinDiverges,
)
from defras_bt.planning.plan import ArmSituation, Situation
from defras_bt.planning.planner import Planner
from defras_bt.planning.program import PlanningTimeout
from defras_bt.recording.bag import BagRecorder
from defras_bt.recording.timeline import TimelineRecorder
from defras_sim.scene import Attachments, Roi, Scene, Tissue
from defras_sim.twin import Twin
from defras_sim.worlds.protocol import HOLD
from tests.executive.stage import Stage, still

COARSE = Scene(
    name="coarse",
    tissue=Tissue(elements_xyz=(3, 3, 1)),
    attachments=Attachments(map=("..........##",) * 12),
    roi=Roi(center_x_m=0.0, center_y_m=0.0),
)
FIRST_SECOND = {"start_s": 0.0, "duration_s": 1.0}


def injection(*faults) -> FaultInjection:
    return FaultInjection(Faults(faults), COARSE, 0)


def test_without_faults_nothing_is_wrapped() -> None:
    plain, world = injection(), BenchWorld(COARSE)
    bag = BagRecorder
    assert plain.world(world) is world
    assert type(plain.twin(COARSE)) is Twin
    assert type(plain.planner(COARSE)) is Planner
    assert plain.breaker() is None
    assert plain.recorders([bag]) == [bag]
    assert plain.trips == []
    assert not plain.hangs


def test_a_twin_that_diverges_and_comes_back() -> None:
    twin = injection(TwinDiverges(**FIRST_SECOND)).twin(COARSE)
    assert isinstance(twin, FaultyTwin)
    assert not twin.track({}, 0.5).converged
    assert np.isnan(twin.force_n)
    assert twin.track({}, 1.0).converged
    assert twin.force_n == 0.0


def test_a_planner_that_times_out_and_comes_back() -> None:
    world = BenchWorld(COARSE)
    faulty = injection(PlannerTimesOut(**FIRST_SECOND))
    faulty.world(world)
    planner = faulty.planner(COARSE)
    assert isinstance(planner, FaultyPlanner)
    arms = {name: ArmSituation() for name in COARSE.arms}
    situation = Situation(arms, frozenset(), ("pull", "move", "fold"))
    with pytest.raises(PlanningTimeout):
        planner.plan(situation, COARSE.attached)
    world.ticks = 20
    assert planner.plan(situation, COARSE.attached).actions


class TestNodes:
    """Nodes that break, found by their path."""

    def broken(self, fault, **options) -> tuple[Stage, list[str]]:
        stage, told = Stage("fras", **options), []
        world = stage.bench.world
        stage.executive.watch(NodeBreaker([fault], lambda: world.time_s, told.append))
        return stage, told

    def test_a_node_of_a_plan_raises_when_its_time_has_come(self) -> None:
        stage, told = self.broken(NodeRaises(node="**/act/*_pull_*"))
        with pytest.raises(ExecutiveFailed) as caught:
            stage.executive.run()
        assert isinstance(caught.value.__cause__, InjectedFault)
        assert told == ["fras/operate/act/4_pull_psm1: node_raises"]
        assert stage.bench.world.sent[-1] == HOLD
        assert stage.notes.told("action")[-1] == "PSM1 has grasped the tissue at (2, 4)."

    def test_other_nodes_and_other_times_are_left_alone(self) -> None:
        for fault in (NodeRaises(node="**/nobody"), NodeRaises(start_s=99.0)):
            stage, told = self.broken(fault)
            stage.until_doing("pull")
            assert told == []

    def test_a_node_that_hangs_is_ended_by_the_deadline(self) -> None:
        stage, _ = self.broken(
            NodeHangs(node="**/act/1_reach_*", start_s=0.5), deadline=interrupting(0.05)
        )
        with pytest.raises(ExecutiveFailed, match="did not return"):
            stage.executive.run()
        assert still(stage.notes.records[-1])


class TestFullDisk:
    """Which recorders a full disk concerns, and from when to when."""

    class Notes:
        def __init__(self) -> None:
            self.ticks: list[float] = []

        def start(self, info) -> None: ...

        def tick(self, record) -> None:
            self.ticks.append(record.time_s)

        def finish(self, summary) -> None: ...

    def test_while_it_is_full_writing_fails(self) -> None:
        stage, notes = Stage("fras"), self.Notes()
        disk = FullDisk(notes, [DiskFull(start_s=0.2, duration_s=0.1)])
        disk.start(None)
        for record in stage.ticks(0.5):
            with suppress(OSError):
                disk.tick(record)
        np.testing.assert_allclose(notes.ticks, [0.0, 0.05, 0.1, 0.15, 0.3, 0.35, 0.4, 0.45])

    @pytest.mark.parametrize(
        ("recorder", "concerned"),
        [("timeline", [True, False]), ("recording", [False, True]), ("all", [True, True])],
    )
    def test_the_recorders_named(self, tmp_path, recorder, concerned) -> None:
        given = [TimelineRecorder(tmp_path / "a"), BagRecorder(tmp_path / "b")]
        wrapped = injection(DiskFull(recorder=recorder)).recorders(given)
        assert [isinstance(one, FullDisk) for one in wrapped] == concerned
