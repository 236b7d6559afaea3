"""Commands that try out, decide once more, count and hand over: what they say and return."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from defras_bt.executive.operation import Operation, operate
from defras_bt.executive.substitution import read_substitutes
from defras_bt.recording.bag import BagRecorder
from defras_bt.recording.decisions import DECISIONS_FILE, DecisionRecorder
from defras_bt.recording.inputs_reader import BAG
from defras_bt.recording.summary import SummaryRecorder
from defras_sim.resources import resource
from defras_sim.scene import Attachments, Roi, Scene, Simulation, Tissue

Defras = Callable[..., tuple[int, str, str]]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A second of a trial with a scripted guard."""
    folder = tmp_path_factory.mktemp("run")
    mocks = folder / "mocks.yaml"
    mocks.write_text("substitutes:\n  - {path: '**/region_visible', status: FAILURE}\n")
    scene = Scene(
        name="slab",
        tissue=Tissue(elements_xyz=(4, 4, 1)),
        attachments=Attachments(map=("..........##",) * 12),
        roi=Roi(center_x_m=0.0, center_y_m=0.0),
        simulation=Simulation(elements_xyz=(4, 4, 1)),
    )
    operation = Operation(
        scene=scene,
        actual=scene,
        scene_file="slab.yaml",
        actual_file=None,
        world="model",
        tree_file=resource("trees/fras.yaml"),
        seed=1,
        force_threshold_n=0.4,
        max_time_s=1.0,
        substitutes=read_substitutes(mocks),
    )
    operate(
        operation,
        [
            BagRecorder(folder / BAG),
            DecisionRecorder(folder / DECISIONS_FILE),
            SummaryRecorder(folder / "run.json"),
        ],
    )
    return folder


def test_a_trial_says_so_in_run_json_and_in_its_log(run: Path) -> None:
    assert json.loads((run / "run.json").read_text())["substituted"] == ["fras/goal/region_visible"]
    assert "This is a trial" in (run / DECISIONS_FILE).read_text()


def test_substitutes_that_fit_no_tree_are_refused_before_anything_is_rehearsed(
    defras: Defras, tmp_path: Path
) -> None:
    mocks = tmp_path / "mocks.yaml"
    mocks.write_text("substitutes:\n  - {path: fras/goal/finnish, status: SUCCESS}\n")
    code, _, err = defras("run", "sim1", "--tree", "fras", "--substitute", str(mocks))
    assert code == 2
    assert "mocks.yaml:2:6: no node has the path 'fras/goal/finnish'; did you mean" in err


def test_replay(defras: Defras, run: Path, tmp_path: Path) -> None:
    code, out, _ = defras("replay", str(run))
    assert (code, out) == (0, "21 ticks decided once more: all as recorded.\n")
    code, out, _ = defras("replay", str(run), "--tree", "defras")
    assert code == 3
    assert out.startswith("Tick 1 is the first that differs, in the status of:")
    assert "As recorded. Tick 1, 0.05 s:" in out
    assert "Replayed. Tick 1, 0.05 s:" in out
    code, _, err = defras("replay", str(tmp_path))
    assert code == 2
    assert "give a folder that defras run --out left" in err


def test_coverage(defras: Defras, run: Path) -> None:
    code, out, _ = defras("tree", "coverage", str(run))
    assert code == 0
    assert "operator_permits: " in out
    assert "ask_human: never ticked" in out
    assert "fras/operate/act/*_reach_*: " in out
    assert "region_visible: never ticked" in out, "a script covers nothing"
    assert defras("tree", "coverage", str(run), "--fail-under", "99")[0] == 3


def test_a_tree_to_groot_and_back(defras: Defras, tmp_path: Path) -> None:
    xml, back = tmp_path / "fras.xml", tmp_path / "back.yaml"
    assert defras("tree", "export-groot", "fras", "-o", str(xml))[0] == 0
    assert defras("tree", "import-groot", str(xml), "-o", str(back))[0] == 0
    code, out, _ = defras("tree", "diff", "fras", str(back))
    assert code == 0
    assert "mean the same" in out
    xml.write_text(xml.read_text().replace("<GiveUp", "<GiveUpp"))
    code, _, err = defras("tree", "import-groot", str(xml))
    assert code == 2
    assert "there is no node 'GiveUpp'; did you mean GiveUp" in err


def test_a_run_to_groot(defras: Defras, run: Path) -> None:
    code, out, _ = defras("tree", "export-groot", str(run))
    assert (code, out) == (0, f"Written to {run / 'run.btlog'}\n")
    assert (run / "run.btlog").read_bytes().startswith(b"BTCPP4-FileLogger2\x01")
    code, _, err = defras("tree", "export-groot", str(run), "-o", str(run / "run.log"))
    assert code == 2
    assert "end in .btlog" in err
