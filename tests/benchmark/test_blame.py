"""Runs with something hidden: what is drawn, and how rows are summed up."""

from __future__ import annotations

from pathlib import Path

import pytest

from defras_bt.benchmark.blame import ASKS, BLAMES, CULPRIT, HIDDEN, _tree, draw_case
from defras_bt.benchmark.retraction import Row
from defras_bt.cli.benchmark_blame import summed_up
from defras_bt.executive.tree_file import read_tree


@pytest.mark.parametrize("hidden", HIDDEN)
def test_what_is_believed_knows_nothing_of_what_is_hidden(hidden):
    case = draw_case(hidden, 3)
    assert case.believed.model.effects == ()
    assert draw_case(hidden, 3) == case
    differs = case.actual != case.believed or bool(case.faults.faults)
    assert differs == (hidden != "nothing")
    assert draw_case(hidden, 4) != case


def test_the_other_tree_differs_by_not_asking(tmp_path: Path):
    asks, blames = (read_tree(_tree(tree, tmp_path)) for tree in (ASKS, BLAMES))
    assert "DiagnoseMismatch" in str(asks)
    assert "DiagnoseMismatch" not in str(blames)
    assert "LearnAttachments" in str(blames)


def row(case: str, tree: str, **values) -> Row:
    said = {
        "outcome": "goal",
        "right": True,
        "wrong": False,
        "warned": True,
        "off_mm": 1.0,
        "force_max_true_n": 0.2,
        **values,
    }
    return Row(case, CULPRIT[case.split()[0]], tree, said)


def test_rows_are_summed_up_by_kind_and_tree():
    rows = [
        row("slip 0", ASKS),
        row("slip 1", ASKS, off_mm=3.0, outcome="human", right=False),
        row("slip 0", BLAMES, off_mm=None, wrong=True),
        row("camera 0", BLAMES, force_max_true_n=0.7),
    ]
    asks, blames, camera = summed_up(rows)
    assert (asks["hidden"], asks["tree"], asks["runs"]) == ("slip", ASKS, 2)
    assert (asks["named"], asks["goal"], asks["human"]) == (1, 1, 1)
    assert (asks["off, median [mm]"], asks["off, worst [mm]"]) == (2.0, 3.0)
    assert (blames["wrong"], blames["off, worst [mm]"]) == (1, None)
    assert camera["F max, worst [N]"] == 0.7
