"""A diagnosis leaves its verdict, an extended scene, a page and a timeline."""

from __future__ import annotations

from dataclasses import replace
from io import StringIO
from pathlib import Path

from rich.console import Console

from defras_bt.diagnosis.diagnosis import Diagnosis
from defras_bt.diagnosis.report_files import write_diagnosis
from defras_bt.diagnosis.report_terminal import print_diagnosis
from defras_bt.diagnosis.verdict_file import read_verdict
from defras_sim.effects.library import effects
from defras_sim.scene import load_scene
from tests.diagnosis.synthetic_diagnosis import (
    ORIGIN,
    SCENE_FILE,
    named_verdict,
    synthetic_curves,
    synthetic_diagnosis,
)


def test_a_tissue_leaves_four_files(tmp_path: Path) -> None:
    written = write_diagnosis(
        tmp_path / "out", synthetic_diagnosis(), ORIGIN, effects(), scene_file=SCENE_FILE
    )
    assert [file.name for file in written] == [
        "verdict.json",
        "extended_scene.yaml",
        "report.html",
        "diagnosis.rrd",
    ]
    verdict = read_verdict(written[0])
    assert verdict.verdict == "named"
    assert verdict.sentence in (tmp_path / "out" / "report.html").read_text().replace("&#39;", "'")
    assert load_scene(written[1]).model.effects[0].effect == "stress_relaxation"


def test_a_specimen_has_no_scene_to_extend(tmp_path: Path) -> None:
    origin = ORIGIN.model_copy(update={"twin": "coupon", "scene": None})
    written = write_diagnosis(
        tmp_path, synthetic_diagnosis(), origin, effects(), exhibits=synthetic_curves()
    )
    assert {file.name for file in written} == {"verdict.json", "report.html", "diagnosis.rrd"}
    assert "Where and when on the tissue" not in (tmp_path / "report.html").read_text()


def printed(diagnosis: Diagnosis) -> str:
    out = StringIO()
    print_diagnosis(Console(width=160, file=out), diagnosis, effects())
    return out.getvalue()


def test_the_terminal_says_it_in_short() -> None:
    said = printed(synthetic_diagnosis())
    for words in (
        "The cause is named",
        "fraction  0.35 (90 %: 0.31 to 0.38)",
        "81 % in the same range, 66 % beyond it",
        "Left unexplained: 19 %",
        "do not trust it there",
        "depth bias: offset of more than 0.7 mm",
    ):
        assert words in said
    unsure = replace(
        named_verdict(), verdict="set", ambiguous=("a", "b"), proposed_motion="pull farther"
    )
    said = printed(replace(synthetic_diagnosis(unsure), complete=False))
    assert "Interrupted" in said
    assert "What would settle it: pull farther" in said
