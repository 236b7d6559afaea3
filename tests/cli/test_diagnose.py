from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.diagnosis.laboratory_bag import Track, laboratory

Call = Callable[..., tuple[int, str, str]]


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return laboratory(Track(duration_s=3.5)).write(tmp_path_factory.mktemp("lab") / "lab.bag")


def test_a_retraction_needs_a_scene(defras: Call, bag: Path) -> None:
    code, _, error = defras("diagnose", str(bag))
    assert code == 2
    assert "--scene is missing" in error


def test_data_that_are_not_there(defras: Call, tmp_path: Path) -> None:
    code, _, error = defras("diagnose", str(tmp_path / "none.mcap"), "--scene", "demo")
    assert code == 2
    assert "valid are MCAP files, bags, and folders that defras run left" in error


def test_a_laboratorys_bag_without_a_topic_map(defras: Call, bag: Path) -> None:
    code, _, error = defras("diagnose", str(bag), "--scene", "demo")
    assert code == 2
    assert "the set-points of psm1 should be on /PSM1/setpoint_cp" in error
    assert "It holds: /camera/points, /left/goal" in error


def test_a_wrong_topic_map_is_told_at_its_place(defras: Call, bag: Path, tmp_path: Path) -> None:
    topics = tmp_path / "lab.yaml"
    topics.write_text("arms:\n  psm3: {setpoint: /left/goal}\ncloud: /camera/points\n")
    code, _, error = defras("diagnose", str(bag), "--scene", "demo", "--topics", str(topics))
    assert code == 2
    assert f"{topics}:2:3: arms.psm3" in error.replace("\n", "")


def test_an_effect_that_is_not_there(defras: Call, bag: Path) -> None:
    code, _, error = defras("diagnose", str(bag), "--scene", "demo", "--without", "stifness")
    assert code == 2
    assert "there is no effect stifness" in error
    assert "stiffness" in error


@pytest.mark.parametrize("twin", ["arm", "coupon"])
def test_tables_take_no_scene(defras: Call, tmp_path: Path, twin: str) -> None:
    table = tmp_path / "table.csv"
    table.write_text("time_s\n0\n")
    code, _, error = defras("diagnose", str(table), "--twin", twin, "--scene", "demo")
    assert code == 2
    assert "--scene and --topics are for recordings" in error


def test_a_table_without_its_columns(defras: Call, tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    table.write_text("time_s,nothing_m\n0,1\n1,2\n")
    code, _, error = defras("diagnose", str(table), "--twin", "arm", "-o", str(tmp_path / "out"))
    assert code == 2
    assert "table.csv:1" in error
