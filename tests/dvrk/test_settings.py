"""Set-up files: faults are said in their place, with what would be valid."""

from __future__ import annotations

from pathlib import Path

import pytest

from defras_bt.dvrk.settings import Ros1Transport, Setup, load_setup
from defras_sim.yaml_source import InvalidFile

GOOD = """\
name: bench
transport: {kind: ros1, master_uri: "http://robot:11311"}
arms:
  psm1: {name: PSM1, frame: PSM1_base}
  psm2: {name: PSM2, frame: PSM2_base, reported: jaw}
cameras:
  depth: {cloud: /depth_camera/points, frame: depth_camera}
"""


def read(folder: Path, text: str) -> Setup:
    file = folder / "lab.yaml"
    file.write_text(text)
    return load_setup(file)


def test_files_are_found_beside_the_set_up(tmp_path: Path) -> None:
    setup = read(tmp_path, GOOD)
    assert setup.transport == Ros1Transport(master_uri="http://robot:11311")
    assert setup.registration == tmp_path / "registration.yaml"
    assert setup.checked == tmp_path / "dvrk_check.json"


def test_the_reported_point_tells_how_far_the_tip_is(tmp_path: Path) -> None:
    arms = read(tmp_path, GOOD).arms
    assert arms["psm1"].reported_to_tip_m == 0.0286
    assert arms["psm2"].reported_to_tip_m == 0.0


@pytest.mark.parametrize(
    ("bad", "where", "says"),
    [
        ("stream: {speed_m_s: 0.2}", 8, "at least 0.002 at 100 Hz"),
        ("stream: {rate_hz: 50}", 8, "greater than or equal to 100"),
        ("limits: {arm_age: 1}", 8, "did you mean arm_age_s"),
        ("transports: {}", 8, "unknown key; did you mean transport"),
    ],
)
def test_what_is_wrong_is_said_in_its_place(
    tmp_path: Path, bad: str, where: int, says: str
) -> None:
    with pytest.raises(InvalidFile) as fault:
        read(tmp_path, GOOD + bad + "\n")
    assert f"lab.yaml:{where}:" in str(fault.value)
    assert says in str(fault.value)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("kind: ros1", "kind: ros3", "'ros1', 'ros2', 'socket'"),
        ("name: PSM2,", "name: PSM1,", "two arms cannot have the same name: PSM1, PSM1"),
        ("cloud: /depth_camera/points, ", "", "give either cloud, or all of"),
        ('"http://robot:11311"', "robot", "should match pattern"),
    ],
)
def test_parts_must_fit_together(tmp_path: Path, old: str, new: str, says: str) -> None:
    with pytest.raises(InvalidFile, match=says):
        read(tmp_path, GOOD.replace(old, new))


def test_the_fingerprint_is_of_the_content_not_of_the_place(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    one = read(tmp_path / "a", GOOD)
    assert read(tmp_path / "b", GOOD + "registration: other.yaml\n").fingerprint == one.fingerprint
    other = read(tmp_path / "b", GOOD.replace("reported: jaw", "reported: wrist"))
    assert other.fingerprint != one.fingerprint
