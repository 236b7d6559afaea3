"""Guards that ask for a reading's age get infinity whenever in doubt."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from defras_bt.sensing.freshness import age_s, ages_s, stale
from defras_sim.geometry import Pose
from defras_sim.scene import ArmName, Attachments, Roi, Scene
from defras_sim.worlds.protocol import ArmObservation, Observation, PointCloud

SCENE = Scene(
    name="s", attachments=Attachments(map=("#" * 12,) * 12), roi=Roi(center_x_m=0, center_y_m=0)
)


def arm(stamp_s: float = 9.9, jaw_rad: float = 0.0, x_m: float = 0.0) -> ArmObservation:
    pose = Pose(np.array([x_m, 0.0, 0.0]))
    return ArmObservation(stamp_s, pose, pose, jaw_rad)


def healthy(psm1: ArmObservation | None = None) -> Observation:
    arms: dict[ArmName, ArmObservation] = {"psm1": psm1 or arm(), "psm2": arm()}
    cloud = PointCloud(9.8, np.zeros((30, 3)))
    return Observation(10.0, arms, cloud, roi_visibility=0.5, roi_visibility_stamp_s=9.8)


def test_fresh_readings_pass() -> None:
    assert stale(healthy(), SCENE) == {}
    assert ages_s(healthy(), SCENE)["cloud"] == pytest.approx(0.2)


@pytest.mark.parametrize("stamp", [None, np.nan, np.inf, -np.inf, 10.1])
def test_unknown_and_future_stamps_are_infinitely_old(stamp: float | None) -> None:
    assert age_s(stamp, 10.0) == np.inf


def test_rounding_of_ticks_is_not_the_future() -> None:
    assert age_s(10.0 + 1e-9, 10.0) == 0.0


@pytest.mark.parametrize("bad", [arm(jaw_rad=np.nan), arm(x_m=np.nan), arm(stamp_s=9.0)])
def test_a_bad_arm_is_named(bad: ArmObservation) -> None:
    assert set(stale(healthy(bad), SCENE)) == {"psm1"}


def test_bad_joints_are_a_bad_arm() -> None:
    bad = replace(arm(), joints=np.full(6, np.nan))
    assert set(stale(healthy(bad), SCENE)) == {"psm1"}


def test_a_missing_arm_cloud_and_visibility_are_named() -> None:
    assert set(stale(Observation(10.0, {}), SCENE)) == {"psm1", "psm2", "cloud", "roi_visibility"}


def test_an_old_or_broken_cloud_is_named_with_its_age() -> None:
    old = replace(healthy(), cloud=PointCloud(9.0, np.zeros((30, 3))))
    assert "1.00 s old; at most 0.5 s" in stale(old, SCENE)["cloud"]
    for points in (np.zeros((0, 3)), np.full((4, 3), np.nan)):
        assert "cloud" in stale(replace(healthy(), cloud=PointCloud(9.9, points)), SCENE)
