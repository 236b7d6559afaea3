"""defras dvrk simulate and topics refuse in words, and write over nobody's files."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from defras_bt.cli.dvrk import app
from defras_bt.cli.errors import UserError
from defras_bt.dvrk.settings import Ros1Transport, load_setup
from defras_bt.dvrk.stand_in.ros_master import free_port
from defras_sim.yaml_source import InvalidFile


def defras_dvrk(*arguments: object) -> None:
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    if isinstance(result.exception, Exception):
        raise result.exception


@pytest.mark.parametrize("name", ["dvrk.yaml", "registration.yaml", "scene.yaml"])
def test_a_laboratory_is_not_written_over(tmp_path: Path, name: str) -> None:
    lab = tmp_path / name
    lab.write_text("of a real robot")
    with pytest.raises(UserError, match=rf"has a {name} already, which may be a robot's"):
        defras_dvrk("simulate", "demo", "--port", free_port(), "--set-up", tmp_path)
    assert lab.read_text() == "of a real robot"
    assert list(tmp_path.iterdir()) == [lab]


def test_nothing_is_written_where_no_master_answers(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"no ROS 1 master answers|ROS 1 is not|rospy"):
        defras_dvrk("simulate", "demo", "--port", free_port(), "--set-up", tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("master", "says"),
    [
        ("nonsense", "--master nonsense: .*such as http://localhost:11311"),
        ("http://localhost:99999", "there is no port 99999; ports go from 1 to 65535"),
    ],
)
def test_a_master_that_cannot_be(master: str, says: str) -> None:
    with pytest.raises(UserError, match=says) as refused:
        defras_dvrk("simulate", "demo", "--master", master)
    assert "pydantic" not in str(refused.value)


def test_a_set_up_with_a_port_that_cannot_be(tmp_path: Path) -> None:
    file = tmp_path / "dvrk.yaml"
    file.write_text(
        "name: bench\ntransport: {kind: ros1, master_uri: 'http://robot:99999'}\n"
        "arms:\n  psm1: {name: PSM1, frame: base}\n"
    )
    with pytest.raises(InvalidFile, match="there is no port 99999"):
        load_setup(file)
    assert Ros1Transport(master_uri="http://robot:65535/").master_uri == "http://robot:65535/"


@pytest.mark.parametrize("option", ["--set-up", "--witness"])
def test_what_cannot_be_written_to(tmp_path: Path, option: str) -> None:
    with pytest.raises(UserError, match=f"{option} /proc/x"):
        defras_dvrk("simulate", "demo", option, "/proc/x/w")
    file = tmp_path / "file"
    file.write_text("kept")
    where = file if option == "--set-up" else tmp_path
    with pytest.raises(UserError, match=f"{option} {where}"):
        defras_dvrk("simulate", "demo", option, where)
    assert file.read_text() == "kept"


def test_topics_are_not_written_into_a_folder(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="is a folder; give the name of a file to write"):
        defras_dvrk("topics", tmp_path / "dvrk.yaml", "-o", tmp_path)
