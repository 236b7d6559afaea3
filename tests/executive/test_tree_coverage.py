"""Coverage counts what was ticked in runs and test sessions, and knows what could have been."""

from __future__ import annotations

import doctest
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

from defras_bt.executive import testing, wildcard
from defras_bt.executive.scripted import Script
from defras_bt.executive.substitution import Substitute, Substitutes
from defras_bt.executive.tree_coverage import tree_coverage
from defras_bt.executive.tree_file import read_tree
from defras_bt.recording.coverage import (
    Coverage,
    InvalidCoverage,
    Seen,
    coverage_of_run,
    read_coverage,
)
from defras_bt.recording.decision_reader import read_decisions
from defras_bt.recording.decisions import DECISIONS_FILE, DecisionRecorder
from defras_bt.recording.record import RunInfo, RunSummary
from defras_sim.resources import resource
from tests.executive.stage import Stage

FRAS = resource("trees/fras.yaml")


def recorded(folder: Path, **options: object) -> Stage:
    """A run of fras up to the pull."""
    recorder = DecisionRecorder(folder / DECISIONS_FILE)
    stage = Stage("fras", beside=[recorder], **options)
    scene = stage.bench.scene
    kinds = stage.executive.tree.kinds()
    stage.recorder.start(
        RunInfo(scene, "", None, None, "bench", "fras", 0, None, 0.3, kinds, {}, scene.attached)
    )
    stage.until_doing("pull")
    stage.recorder.finish(RunSummary({}))
    return stage


class TestRuns:
    def test_counts_are_those_of_the_records(self, tmp_path):
        stage = recorded(tmp_path)
        expected: dict[str, Counter[str]] = {}
        for record in stage.notes.records:
            for path, status in record.node_status.items():
                if status:
                    expected.setdefault(path, Counter())[status] += 1
        found = coverage_of_run(read_decisions(tmp_path)).trees["fras"]
        assert {path: seen.statuses for path, seen in found.items()} == expected

    def test_runs_add_up(self, tmp_path):
        recorded(tmp_path)
        once = read_coverage([tmp_path]).trees["fras"]["fras/goal/region_visible"]
        twice = read_coverage([tmp_path, tmp_path]).trees["fras"]["fras/goal/region_visible"]
        assert {k: 2 * v for k, v in once.statuses.items()} == twice.statuses
        assert set(once.codes) == set(twice.codes) == {"hidden"}

    def test_leaves_and_answers_of_the_tree(self, tmp_path):
        recorded(tmp_path)
        seen = read_coverage([tmp_path]).trees["fras"]
        covered = tree_coverage(read_tree(FRAS), seen)
        leaf = {leaf.path.removeprefix("fras/"): leaf for leaf in covered.leaves}
        assert str(leaf["goal/finish"]) == "never ticked"
        assert leaf["goal/region_visible"].missing == ("SUCCESS",)
        assert leaf["operate/act/*_grasp_*"].missing == ("FAILURE",)
        assert leaf["operate/act/*_fold_*"].ticked == 0
        ticked = [one for one in covered.leaves if one.ticked]
        assert covered.leaf_share == len(ticked) / len(covered.leaves)
        assert 0 < covered.branch_share < covered.leaf_share < 1

    def test_nothing_seen_and_everything_seen(self):
        tree = read_tree(FRAS)
        nothing = tree_coverage(tree, {})
        assert (nothing.leaf_share, nothing.branch_share) == (0, 0)
        every = Counter(("SUCCESS", "FAILURE", "RUNNING"))
        paths = [leaf.path.replace("*_", "1_", 1).replace("_*", "_psm1") for leaf in nothing.leaves]
        whole = tree_coverage(tree, {path: Seen("", every) for path in paths})
        assert (whole.leaf_share, whole.branch_share) == (1, 1)

    def test_what_a_script_says_covers_nothing(self, tmp_path):
        told = Substitute(path="**/operate/force_accepted", **Script(status="SUCCESS").model_dump())
        substitutes = Substitutes(((told, (Path("mocks.yaml"), 1, 1)),))
        recorded(tmp_path, substitutes=substitutes)
        assert "fras/operate/force_accepted" not in read_coverage([tmp_path]).trees["fras"]


class TestSessions:
    def test_a_session_notes_executives_and_benches(self, tmp_path):
        """In a session of its own, as a user's."""
        (tmp_path / "conftest.py").write_text(
            'pytest_plugins = ["defras_bt.executive.testing.pytest_plugin"]\n'
        )
        (tmp_path / "test_mine.py").write_text(
            "from defras_bt.executive.nodes import Wait\n"
            "def test_it_waits(node_bench):\n"
            "    node = node_bench.node(Wait, seconds=0.1)\n"
            "    assert node_bench.ticks(node, 3) == ['RUNNING', 'RUNNING', 'SUCCESS']\n"
        )
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"]
        command += ["--tree-coverage", "seen.jsonl", str(tmp_path)]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        leaves = read_coverage([tmp_path / "seen.jsonl"]).leaves
        assert leaves["Wait"].statuses == {"RUNNING": 2, "SUCCESS": 1}
        assert leaves["Wait"].codes == {"waiting": 2, "waited": 1}

    def test_lines_of_several_processes_add_up(self, tmp_path):
        one = Coverage()
        one.leaf("Wait", "RUNNING", "waiting")
        one.in_tree("fras", "fras/goal", "reactive", "FAILURE", "hidden")
        file = tmp_path / "seen.jsonl"
        file.write_text(f"{one.text()}\n{one.text()}\n", encoding="utf-8")
        total = read_coverage([file])
        assert total.leaves["Wait"].statuses == {"RUNNING": 2}
        assert total.trees["fras"]["fras/goal"].codes == {"hidden": 2}

    @pytest.mark.parametrize("text", ["{}", "[]", "nonsense", '{"schema": "other"}'])
    def test_other_files_are_refused(self, tmp_path, text):
        file = tmp_path / "seen.jsonl"
        file.write_text(text, encoding="utf-8")
        with pytest.raises(InvalidCoverage, match=r"seen\.jsonl:1: no coverage"):
            read_coverage([file])

    def test_a_missing_file_is_refused(self, tmp_path):
        with pytest.raises(InvalidCoverage, match="cannot be read"):
            read_coverage([tmp_path / "none.jsonl"])


@pytest.mark.parametrize("module", [testing, wildcard])
def test_the_examples_in_the_documentation(module):
    result = doctest.testmod(module)
    assert result.attempted > 0
    assert result.failed == 0
