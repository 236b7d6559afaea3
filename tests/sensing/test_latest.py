"""Old, repeated and future messages against the newest reading."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from defras_bt.sensing.latest import LatestReadings
from defras_sim.geometry import Pose
from defras_sim.scene import Attachments, Camera, Roi, Scene
from defras_sim.worlds.protocol import ArmObservation, CameraImage, Observation, PointCloud

NOISY = Scene(
    name="s", attachments=Attachments(map=("#" * 12,) * 12), roi=Roi(center_x_m=0, center_y_m=0)
)
SMOOTH = NOISY.model_copy(
    update={"depth_camera": Camera(position_m=(0.17, 0.0, 0.2), target_m=(0.0, 0.0, 0.0))}
)


def cloud(stamp_s: float, value_m: float | None = None) -> PointCloud:
    """Of another shape at every time, unless told."""
    return PointCloud(stamp_s, np.full((30, 3), stamp_s if value_m is None else value_m))


def seen(now_s: float, **readings: object) -> Observation:
    return Observation(now_s, {}, **readings)


def stamps_of_clouds(scene: Scene, *given: Observation) -> list[float]:
    latest = LatestReadings(scene)
    return [latest.update(observation).cloud.stamp_s for observation in given]


def test_in_order_everything_passes_through() -> None:
    latest = LatestReadings(NOISY)
    for now_s in (1.0, 1.1, 1.2):
        given = seen(now_s, cloud=cloud(now_s), roi_visibility=now_s, roi_visibility_stamp_s=now_s)
        assert latest.update(given) == given


def test_an_overtaken_message_changes_nothing() -> None:
    given = [seen(1.0, cloud=cloud(1.0)), seen(1.1, cloud=cloud(0.9)), seen(1.2, cloud=cloud(1.2))]
    assert stamps_of_clouds(NOISY, *given) == [1.0, 1.0, 1.2]


def test_an_overtaken_visibility_changes_nothing() -> None:
    latest = LatestReadings(NOISY)
    latest.update(seen(1.0, roi_visibility=0.3, roi_visibility_stamp_s=1.0))
    late = latest.update(seen(1.1, roi_visibility=0.9, roi_visibility_stamp_s=0.5))
    assert (late.roi_visibility, late.roi_visibility_stamp_s) == (0.3, 1.0)


def test_arms_are_told_apart() -> None:
    def arm(stamp_s: float) -> ArmObservation:
        return ArmObservation(stamp_s, Pose(np.zeros(3)), Pose(np.zeros(3)), 0.0)

    latest = LatestReadings(NOISY)
    latest.update(Observation(1.0, {"psm1": arm(1.0), "psm2": arm(0.8)}))
    late = latest.update(Observation(1.1, {"psm1": arm(0.9), "psm2": arm(0.9)}))
    assert {name: arm.stamp_s for name, arm in late.arms.items()} == {"psm1": 1.0, "psm2": 0.9}


@pytest.mark.parametrize("stamp_s", [99.0, float("nan")])
def test_a_wrong_stamp_is_let_through_and_does_not_shut_out_what_follows(stamp_s) -> None:
    given = [
        seen(1.0, cloud=cloud(1.0)),
        seen(1.1, cloud=cloud(stamp_s)),
        seen(1.2, cloud=cloud(1.2)),
    ]
    assert np.array_equal(stamps_of_clouds(NOISY, *given), [1.0, stamp_s, 1.2], equal_nan=True)


def test_a_cloud_that_repeats_itself_grows_old() -> None:
    given = [seen(now_s, cloud=cloud(now_s, 0.01)) for now_s in (1.0, 1.1, 1.2)]
    assert stamps_of_clouds(NOISY, *given) == [1.0, 1.0, 1.0]


def test_a_camera_without_noise_may_repeat_itself() -> None:
    given = [seen(now_s, cloud=cloud(now_s, 0.01)) for now_s in (1.0, 1.1, 1.2)]
    assert stamps_of_clouds(SMOOTH, *given) == [1.0, 1.1, 1.2]


def test_so_may_a_picture_but_not_its_depth() -> None:
    def picture(stamp_s: float, depth_m: np.ndarray | None) -> CameraImage:
        rgb = np.zeros((2, 2, 3), np.uint8)
        return CameraImage(stamp_s, rgb, depth_m, np.eye(3), Pose(np.zeros(3)))

    depth_m = np.array([[0.1, np.nan], [0.2, 0.3]])
    latest = LatestReadings(NOISY)
    for now_s in (1.0, 1.1):
        sensed = latest.update(
            seen(
                now_s,
                depth_image=picture(now_s, depth_m),
                endoscope_image=picture(now_s, None),
            )
        )
    assert (sensed.depth_image.stamp_s, sensed.endoscope_image.stamp_s) == (1.0, 1.1)


def test_what_is_not_there_stays_away() -> None:
    latest = LatestReadings(NOISY)
    latest.update(seen(1.0, cloud=cloud(1.0)))
    assert replace(latest.update(seen(1.1)), time_s=0.0) == Observation(0.0, {})
