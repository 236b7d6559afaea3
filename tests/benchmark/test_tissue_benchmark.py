"""The tissue benchmark measures what it says, and leaves it where it was told."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from defras_bt.benchmark import tissue
from defras_bt.benchmark.tissue_models import BulletSlab, FelupeTissue, MujocoSlab, OwnTissue
from defras_bt.benchmark.tissue_motions import CENTRE_LIFT, MOTIONS, OFF_CENTRE_LIFT
from defras_bt.benchmark.tissue_paths import PathResult
from defras_bt.benchmark.tissue_plot import tissue_figure
from defras_bt.cli import benchmark_tissue
from defras_bt.cli.benchmark import app


@pytest.fixture(scope="module")
def case() -> tissue.Case:
    return tissue.follow(
        tissue.OWN,
        lambda: OwnTissue(OFF_CENTRE_LIFT, "neo_hookean", (4, 4, 1)),
        OFF_CENTRE_LIFT,
        "neo_hookean",
        0.0025,
        0.010,
    )


def test_a_case_has_a_frame_a_step_and_an_error_a_checkpoint(case):
    assert len(case.frames_s) == len(case.computing_s) == 4
    assert case.forces_n.shape == (2, 3)
    assert case.simulated_s == pytest.approx(0.010 / 0.015)
    row = case.row()
    assert row["checkpoints"] == 2
    assert row["force error / allowed"] == pytest.approx(case.force_error.max())


def test_a_wrong_force_is_called_wrong(case):
    """Twice the force is off by the whole force, which is 20 times what is allowed."""
    wrong = tissue.follow(
        tissue.OWN, lambda: _Double(), CENTRE_LIFT, "neo_hookean", 0.005, CENTRE_LIFT.length_m
    )
    assert wrong.force_error[-1] == pytest.approx(20.0, rel=0.02)
    assert wrong.force_ratio[-1] == pytest.approx(2.0, rel=0.001)
    assert wrong.shape_median_m.max() < 1e-5


class _Double:
    """The converged solution with all forces doubled."""

    title = "double"

    def __init__(self) -> None:
        self._right = tissue.reference(CENTRE_LIFT.name, "neo_hookean")
        self._at = -1

    def go_to(self, tip) -> None:
        self._at += 1

    def force_n(self) -> np.ndarray:
        return 2 * self._right.forces_n[self._at]

    def surface_m(self) -> np.ndarray:
        return self._right.surfaces_m[self._at]


def test_targets_compare_computing_on_the_same_motions(case):
    slow = replace(case, kind=tissue.FELUPE, computing_s=20 * case.computing_s)
    lines = {line[""]: line for line in tissue.targets([case, slow], [])}
    ratio = lines["times faster than felupe, same mesh"]
    assert ratio["measured"] == pytest.approx(20.0)
    assert ratio["met"] == "yes"


def _path(stale: int) -> PathResult:
    """A path of 200 steps, of which so many did not converge."""
    return PathResult(
        path=0,
        material="neo_hookean",
        attached=12,
        steps=200,
        stale=stale,
        untrue=0,
        iterations=400,
        slowest_s=0.01,
        force_n=0.1,
        error=None,
    )


@pytest.mark.parametrize(("stale", "met"), [(2, "yes"), (3, "no")])
def test_random_paths_have_a_target_of_their_own(case, stale, met):
    """Of 400 steps two may fail: that is 99.5 %."""
    line = tissue.targets([case], [_path(0), _path(stale)])[-1]
    assert line[""] == "steps that converged on 2 random paths, %"
    assert line["measured"] == pytest.approx(100.0 * (400 - stale) / 400)
    assert (line["target"], line["met"]) == ("at least 99.5", met)
    names = [line[""] for line in tissue.targets([case], [])]
    assert not [name for name in names if "random paths" in name], "none were measured"


def test_help_names_the_full_requirement():
    said = CliRunner().invoke(app, ["tissue", "--help"], env={"COLUMNS": "200"}).output
    assert "--paths 2000" in said


@pytest.mark.parametrize("model", [FelupeTissue, BulletSlab, MujocoSlab])
def test_other_models_follow_the_first_millimetres(model):
    made = (
        model(CENTRE_LIFT, "neo_hookean", (4, 4, 1))
        if model is FelupeTissue
        else model(CENTRE_LIFT)
    )
    for tip in CENTRE_LIFT.tips(0.001)[:3]:
        made.go_to(tip)
    force, surface = made.force_n(), made.surface_m()
    assert force[2] > 1e-4
    # Tetrahedra of a grid prefer one diagonal, and pull a little sideways.
    assert np.abs(force[:2]).max() < 0.6 * force[2]
    middle = surface[25 * 12 + 12]
    assert middle[2] == pytest.approx(0.003, abs=0.001)


def test_the_motions_are_the_five_that_were_promised():
    assert [motion.name for motion in MOTIONS] == [
        "centre_lift",
        "off_centre_lift",
        "corner_fold",
        "planar_move",
        "pull_60",
    ]


def test_an_interrupted_run_leaves_what_it_measured(monkeypatch, tmp_path, case):
    def interrupted() -> tissue.Case:
        raise KeyboardInterrupt

    works = [tissue.Work("one", lambda: case), tissue.Work("two", interrupted)]
    monkeypatch.setattr(tissue, "works", lambda *, quick: iter(works))
    result = CliRunner().invoke(app, ["tissue", "--out", str(tmp_path)])
    assert result.exit_code != 0
    found = json.loads((tmp_path / "tissue.json").read_text())
    assert found["tables"]["Every model and motion"][0]["motion"] == "Off-centre lift"
    with (tmp_path / "tissue.csv").open() as stream:
        assert len(list(csv.DictReader(stream))) == 1
    assert "<svg" in (tmp_path / "tissue.html").read_text()


def test_a_folder_that_cannot_be_written_is_told_before_anything_runs(monkeypatch, tmp_path):
    (tmp_path / "file").write_text("")
    monkeypatch.setattr(tissue, "works", lambda *, quick: pytest.fail("it ran"))
    result = CliRunner().invoke(app, ["tissue", "--out", str(tmp_path / "file")])
    assert isinstance(result.exception, benchmark_tissue.UserError)
    assert "--out" in str(result.exception)


def test_the_picture_shows_every_model(case):
    svg = tissue_figure([case], [tissue.Growth(tissue.OWN, (4, 4, 1), 465, 0.003)])
    assert svg.startswith("<svg")
