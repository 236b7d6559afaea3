"""``defras explain PLAN`` and the rules that ``defras plan`` keeps in a scene."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from defras_bt.planning.execution import Execution
from defras_bt.planning.plan_file import save_plan
from defras_bt.planning.preoperative import result_of
from defras_sim.resources import resource
from defras_sim.scene import load_scene

DEMO = Path(resource("sim/scenes/demo.yaml"))
EXECUTIONS = (
    Execution((2, 5), ("pull", "fold"), 0.9, 0.10, True),
    Execution((3, 5), ("pull", "fold"), 0.6, 0.05, True),
)


@pytest.fixture
def plan_file(tmp_path: Path) -> Path:
    file = tmp_path / "demo.plan.json"
    save_plan(result_of(load_scene(DEMO), EXECUTIONS, 0.15), file)
    return file


def test_every_action_has_its_reason(defras, plan_file):
    code, out, _ = defras("explain", str(plan_file))
    assert code == 0
    assert "3. PSM1 grasps the tissue at (2,5), because only held tissue can be moved." in out


def test_why_not_another_point(defras, plan_file):
    code, out, _ = defras("explain", str(plan_file), "--why-not", "grasp psm1 point (3,5)")
    assert code == 0
    assert "the best shows 60% of the region with at most 0.05 N; the goal is 80%." in out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--why-not", "cut"], "'cut' is no rule; valid is an action, an arm, a point"),
        (["--why-not", "fold", "--scene", "sim1"], "plan again for the scene 'sim1'"),
        (["--tick", "3"], "they belong to a run's folder"),
    ],
)
def test_questions_that_cannot_be_answered(defras, plan_file, arguments, message):
    code, _, err = defras("explain", str(plan_file), *arguments)
    assert code == 2
    assert message in " ".join(err.split())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["demo", "--forbid", "fold", "--reason", "x"], "demo is a shipped scene; copy"),
        (["FILE", "--forbid", "cut", "--reason", "x"], "'cut' is no rule"),
        (["FILE", "--forbid", "fold"], "--reason is missing"),
        (["FILE", "--reason", "x"], "give one of them"),
        (["FILE", "--forbid", "fold", "--prefer", "psm1", "--reason", "x"], "give one of them"),
        (["FILE", "demo", "--forbid", "fold", "--reason", "x"], "a rule belongs to one scene"),
        (["FILE", "--forbid", "point (9,9)", "--reason", "x"], "(9, 9) is no grasp point"),
    ],
)
def test_rules_that_cannot_be_kept(defras, tmp_path, arguments, message):
    file = tmp_path / "mine.yaml"
    shutil.copy(DEMO, file)
    code, _, err = defras("plan", *(str(file) if a == "FILE" else a for a in arguments))
    assert code == 2
    assert message in " ".join(err.split())
    assert file.read_text() == DEMO.read_text()


def test_what_is_not_there_may_have_been_either(defras, tmp_path):
    code, _, err = defras("explain", str(tmp_path / "none.plan.json"))
    assert code == 2
    assert "does not exist; give a folder that defras run --out left, or a plan file" in " ".join(
        err.split()
    )
