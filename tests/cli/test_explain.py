"""``defras explain`` tells a recorded run from its files alone."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from defras_bt.recording.decisions import DECISIONS_FILE, DecisionRecorder
from tests.executive.stage import Stage
from tests.recording.synthetic_run import SyntheticRun

Defras = Callable[..., tuple[int, str, str]]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    recorder = DecisionRecorder(folder / DECISIONS_FILE)
    stage = Stage("fras", beside=[recorder])
    stage.recorder.start(SyntheticRun(with_images=False, grid=9).info)
    stage.until_doing("reach")
    stage.bench.world.cloud_m = None
    assert stage.until_over() == "human"
    stage.recorder.finish(None)
    return folder


def test_the_whole_run(defras: Defras, run: Path) -> None:
    code, out, _ = defras("explain", str(run))
    assert code == 0
    assert "The operation ended." in out
    assert "[stale]" in out
    assert "reach psm1 (step 1)" in out


def test_one_tick_with_the_meaning_of_its_codes(defras: Defras, run: Path) -> None:
    code, out, _ = defras("explain", str(run), "--tick", "1")
    assert code == 0
    assert "Tick 1, 0.05 s: PSM1 is on its way" in out
    assert "[moving] means: the tip is on its way." in out


def test_a_moment_by_its_time(defras: Defras, run: Path) -> None:
    assert defras("explain", str(run), "--time", "0.07")[1].startswith("Tick 1, 0.05 s")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--tick", "99999"), "valid: 0 to"),
        (("--tick", "1", "--time", "1"), "one of them"),
        (("--tick", "-1"), "tick"),
    ],
)
def test_what_is_not_there(
    defras: Defras, run: Path, arguments: tuple[str, ...], says: str
) -> None:
    code, _, err = defras("explain", str(run), *arguments)
    assert code == 2
    assert says in err


def test_no_run(defras: Defras, tmp_path: Path) -> None:
    code, _, err = defras("explain", str(tmp_path))
    assert code == 2
    assert "decisions.jsonl" in err
