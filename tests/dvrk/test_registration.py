"""Registration files: they come back as written, and what is wrong with them is said in place."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from defras_bt.dvrk.registering.registration import (
    Placed,
    Registration,
    read_registration,
    write_registration,
)
from defras_sim.geometry import Pose
from defras_sim.yaml_source import InvalidFile

NOW = datetime(2026, 3, 1, 9, 30, tzinfo=UTC)


def test_a_registration_comes_back_as_written(tmp_path: Path) -> None:
    pose = Pose(np.array([0.1, -0.2, 0.3]), Rotation.from_rotvec([0.3, 0.2, -1.0]).as_matrix())
    registration = Registration(measured=NOW, scene="demo")
    registration = registration.with_arm("psm1", Placed.of(pose), NOW)
    registration = registration.with_camera("depth", Placed.of(pose.inverse()), NOW)
    write_registration(registration, tmp_path / "registration.yaml")
    back = read_registration(tmp_path / "registration.yaml")
    assert back == registration
    np.testing.assert_allclose(back.arms["psm1"].pose.rotation, pose.rotation, atol=1e-12)
    np.testing.assert_allclose(back.arms["psm1"].pose.position_m, pose.position_m)


def test_a_rotation_has_length_one(tmp_path: Path) -> None:
    file = tmp_path / "registration.yaml"
    file.write_text(
        "measured: 2026-03-01T09:30:00Z\nscene: demo\narms:\n  psm1:\n"
        "    position_m: [0, 0, 0]\n    quaternion_xyzw: [0, 0, 0, 2]\n"
    )
    with pytest.raises(InvalidFile, match=r"registration\.yaml:6:5: .*length 1.*is 2"):
        read_registration(file)
