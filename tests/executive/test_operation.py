"""Whole operations in ModelWorld: outcome, determinism, and what is left when something breaks."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from defras_bt.executive.executive import ExecutiveFailed
from defras_bt.executive.operation import Operation, operate
from defras_bt.faults.arms import ArmFault, CommandsLost, Republished
from defras_bt.faults.faults import FaultInjection, Faults
from defras_bt.recording.bag import BagRecorder
from defras_bt.recording.bag_reader import read_bag
from defras_bt.recording.record import RunInfo, RunSummary, TickRecord
from defras_bt.recording.summary import SummaryRecorder, read_run_json
from defras_bt.recording.timeline import TimelineRecorder
from defras_bt.recording.timeline_digest import timeline_digest
from defras_bt.sensing.dead_reckoning import STRAYED_M
from defras_sim.resources import resource
from defras_sim.scene import Attachments, Roi, Scene, Simulation, Tissue
from defras_sim.worlds.error import WorldError
from defras_sim.worlds.model_world import ModelWorld

BELIEVED = tuple("........####" if 2 <= row <= 9 else "............" for row in range(12))
# In truth two more stitches hold the far corner.
MORE = ("...####.....", "...####.....", *BELIEVED[2:])


def scene(rows: tuple[str, ...] = BELIEVED) -> Scene:
    return Scene(
        name="slab",
        tissue=Tissue(elements_xyz=(6, 6, 1)),
        attachments=Attachments(map=rows),
        roi=Roi(center_x_m=0.0, center_y_m=0.0),
        simulation=Simulation(elements_xyz=(7, 7, 1)),
    )


def operation(actual: Scene, tree: str = "fras", **changes: object) -> Operation:
    plain = Operation(
        scene=scene(),
        actual=actual,
        scene_file="slab.yaml",
        actual_file=None,
        world="model",
        tree_file=resource(f"trees/{tree}.yaml"),
        seed=3,
        force_threshold_n=0.4,
    )
    return replace(plain, **changes)


class KeepEvents:
    """Keeps the sentences of a run."""

    def __init__(self) -> None:
        self.kinds: list[str] = []
        self.sent_speed_m_s: list[float] = []

    def start(self, info: RunInfo) -> None: ...

    def tick(self, record: TickRecord) -> None:
        self.kinds += [event.kind for event in record.events]
        speeds = [abs(arm.linear_m_s).max() for arm in record.sent.arms.values()]
        self.sent_speed_m_s.append(max(speeds, default=0.0))

    def finish(self, summary: RunSummary) -> None: ...


def test_the_baseline_exposes_the_region_when_the_belief_is_right() -> None:
    kept = KeepEvents()
    summary = operate(operation(scene()), [kept])
    assert summary.values["outcome"] == "goal"
    assert summary.values["roi_visibility"] >= 0.8
    assert summary.values["attachment_updates"] == {"tried": 0, "adopted": 0}
    assert kept.kinds[-1] == "goal"
    assert kept.sent_speed_m_s[-1] == 0.0, "the tick that ends a run sends no motion"


def test_the_same_seed_gives_the_same_timeline(tmp_path: Path) -> None:
    """Golden: a whole run that warns and learns, twice, column by column."""
    digests = []
    for name in ("one.rrd", "two.rrd"):
        recorder = TimelineRecorder(tmp_path / name)
        operate(operation(scene(MORE), "defras", max_time_s=6.0), [recorder])
        digests.append(timeline_digest(tmp_path / name))
    assert digests[0] == digests[1]


def test_another_seed_gives_another_timeline(tmp_path: Path) -> None:
    digests = set()
    for seed in (1, 2):
        recorder = TimelineRecorder(tmp_path / f"{seed}.rrd")
        operate(operation(scene(), seed=seed, max_time_s=1.0), [recorder])
        digests.add(timeline_digest(tmp_path / f"{seed}.rrd"))
    assert len(digests) == 2


def test_hidden_attachments_are_noticed() -> None:
    kept = KeepEvents()
    summary = operate(operation(scene(MORE), "defras", max_time_s=30.0), [kept])
    assert sum(summary.values["warnings"].values()) >= 1
    assert summary.values["attachment_updates"]["tried"] >= 1


@pytest.mark.parametrize("kind", [Republished, CommandsLost])
def test_an_arm_that_does_not_show_what_it_was_told_is_commanded_no_farther(
    kind: type[ArmFault],
) -> None:
    kept, start_s = KeepEvents(), 0.5
    faults = Faults((kind(arm="psm1", start_s=start_s),))
    plan = operation(scene(), max_time_s=20.0)
    summary = operate(plan, [kept], faults=FaultInjection(faults, scene(), seed=0))
    assert summary.values["outcome"] == "human"
    tick_s = scene().tick_s
    unseen_m = sum(kept.sent_speed_m_s[round(start_s / tick_s) :]) * tick_s
    assert np.sqrt(3) * unseen_m > STRAYED_M
    assert unseen_m < 2 * STRAYED_M


def test_what_was_recorded_before_a_failure_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real_step = ModelWorld.step

    def breaks_after_a_second(world: ModelWorld) -> None:
        if world.observe().time_s > 1.0:
            raise WorldError("the camera fell off")
        real_step(world)

    monkeypatch.setattr(ModelWorld, "step", breaks_after_a_second)
    recorders = [
        TimelineRecorder(tmp_path / "run.rrd"),
        BagRecorder(tmp_path / "recording.mcap"),
        SummaryRecorder(tmp_path / "run.json"),
    ]
    kept = KeepEvents()
    with pytest.raises(ExecutiveFailed, match="the camera fell off"):
        operate(operation(scene()), [*recorders, kept])
    assert kept.kinds[-1] == "error"
    assert kept.sent_speed_m_s[-1] == 0.0
    assert read_run_json(tmp_path / "run.json").outcome == "error"
    assert timeline_digest(tmp_path / "run.rrd")
    assert len(read_bag(tmp_path / "recording.mcap")["/PSM1/measured_cp"].time_s) > 10


class Finished(KeepEvents):
    """Keeps what it was finished with."""

    def __init__(self, stops_at_start: bool = False) -> None:
        super().__init__()
        self.stops_at_start = stops_at_start
        self.outcomes: list[object] = []

    def start(self, info: RunInfo) -> None:
        if self.stops_at_start:
            raise KeyboardInterrupt

    def finish(self, summary: RunSummary) -> None:
        self.outcomes.append(summary.values["outcome"])


def test_recorders_are_finished_where_a_run_cannot_be_summed_up(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def summary(*_: object) -> RunSummary:
        raise ArithmeticError("no sum")

    monkeypatch.setattr(SummaryRecorder, "summary", summary)
    kept = Finished()
    with pytest.raises(ArithmeticError, match="no sum"):
        operate(operation(scene(), max_time_s=0.2), [kept])
    assert kept.outcomes == ["not_reached"]


def test_recorders_are_finished_where_the_start_was_interrupted() -> None:
    kept = Finished(stops_at_start=True)
    with pytest.raises(KeyboardInterrupt):
        operate(operation(scene(), max_time_s=0.2), [kept])
    assert kept.outcomes == ["error"]
