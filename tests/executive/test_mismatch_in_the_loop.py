"""The shipped tree, in a world where something other than attachments goes wrong."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from defras_bt.diagnosis.mismatch.finding import MismatchFinding
from defras_bt.diagnosis.mismatch.ranking import MismatchRanking
from defras_bt.executive.operation import Operation, operate
from defras_bt.faults.clouds import Displaced
from defras_bt.faults.faults import NO_FAULTS, FaultInjection, Faults
from defras_bt.planning.plan import Action, Plan
from defras_bt.recording.record import Event, RunInfo, RunSummary, TickRecord
from defras_sim.resources import resource
from defras_sim.scene import ModelExtension, Scene, load_scene


class Listener:
    def __init__(self) -> None:
        self.events: list[Event] = []
        self.last: TickRecord | None = None

    def start(self, info: RunInfo) -> None:
        pass

    def tick(self, record: TickRecord) -> None:
        self.events += record.events
        self.last = record

    def finish(self, summary: RunSummary) -> None:
        pass

    def told(self, kind: str) -> list[str]:
        return [event.sentence for event in self.events if event.kind == kind]


@pytest.fixture(scope="module")
def believed() -> Scene:
    return load_scene(resource("sim/scenes/demo.yaml"))


@pytest.fixture(scope="module")
def tree_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """trees/defras.yaml without rehearsals, which take time and concern other nodes."""
    folder = tmp_path_factory.mktemp("trees")
    for file in resource("trees").glob("*.yaml"):
        shutil.copy(file, folder)
    main = folder / "defras.yaml"
    main.write_text(main.read_text().replace(", rehearse: 12", ""))
    return main


def run(believed: Scene, actual: Scene, tree_file: Path, faults: Faults = NO_FAULTS) -> Listener:
    steps = ("reach", "open", "grasp", "pull", "fold")
    plan = Plan(tuple(Action(name, "psm1", (2, 4), t) for t, name in enumerate(steps, 1)))
    listener = Listener()
    operation = Operation(
        scene=believed,
        actual=actual,
        scene_file="demo.yaml",
        actual_file=None,
        world="model",
        tree_file=tree_file,
        seed=1,
        force_threshold_n=0.6,
        preoperative=plan,
        max_time_s=6.8,
    )
    injected = FaultInjection(faults, believed, 1)
    operate(operation, [listener], faults=injected)
    return listener


def test_tissue_that_slips_is_grasped_again(believed: Scene, tree_file: Path) -> None:
    slip = ModelExtension.of({"grasp_slip": {"distance_m": 0.012, "time_s": 4.5}})
    heard = run(believed, believed.model_copy(update={"model": slip}), tree_file)
    (found,) = heard.told("diagnosis")
    assert "the tissue slipped in the jaw of PSM1 by" in found
    assert float(found.split("PSM1 by ")[1].split(" mm")[0]) == pytest.approx(12.0, abs=2.5)
    assert any("may be grasped there once more" in said for said in heard.told("hold"))
    assert heard.told("learning") == [], "no attachment was changed for it"
    grasps = [said for said in heard.told("action") if "has grasped" in said]
    assert len(grasps) == 2


def test_a_bumped_camera_is_registered_anew(believed: Scene, tree_file: Path) -> None:
    bump = Displaced(start_s=4.5, offset_m=(0.0, 0.001, 0.005))
    heard = run(believed, believed, tree_file, Faults((bump,), 1))
    found, registered = heard.told("diagnosis")
    assert "the depth camera was moved by" in found
    assert registered.startswith("The camera was registered anew")
    assert heard.told("learning") == []
    assert heard.last is not None
    assert heard.last.reading is not None
    assert heard.last.reading.mu_m["local"] < np.max(believed.thresholds.delta_m) / 3


def test_where_nothing_can_be_told_for_long_attachments_are_learned(
    believed: Scene, tree_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def cannot_tell(*_: object) -> MismatchFinding:
        asked.append(True)
        return MismatchFinding("unclear", "the camera moved, or attachments are others")

    monkeypatch.setattr(MismatchRanking, "explain", cannot_tell)
    actual = load_scene(resource("sim/scenes/demo_actual.yaml"))
    # The demo's mismatch grows from 6 to 7 mm at once, which would end the operation.
    wide = believed.thresholds.model_copy(update={"delta_m": (0.003, 0.005, 0.015)})
    heard = run(believed.model_copy(update={"thresholds": wide}), actual, tree_file)
    assert len(asked) >= 2
    told = [event for event in heard.events if event.kind in ("warning", "learning")]
    first = next(index for index, event in enumerate(told) if event.kind == "learning")
    assert "state 2" in told[first - 1].sentence, [event.sentence for event in told]
