from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from defras_bt.cli.files import find_scene
from defras_bt.diagnosis.recording import Readings
from defras_bt.diagnosis.recording_reader import UnusableRecording, read_recording
from defras_bt.diagnosis.topic_map import TopicMap, read_topic_map
from defras_sim.geometry import Pose
from defras_sim.scene import Scene
from defras_sim.yaml_source import InvalidFile
from tests.diagnosis.laboratory_bag import Track, laboratory

TRACK = Track()


@pytest.fixture(scope="module")
def scene() -> Scene:
    return find_scene("demo")[1]


def topics(frame: str | None = None, unit: str = "m", **more: Any) -> TopicMap:
    pose = {"unit": unit, "frame": frame}
    return TopicMap.model_validate(
        {
            "arms": {
                "psm1": {
                    "setpoint": {"topic": "/left/goal", **pose},
                    "measured": {"topic": "/left/seen", **pose},
                    "jaw": {"topic": "/left/jaw", "unit": "deg"},
                }
            },
            "cloud": {"topic": "/camera/points", **pose},
            **more,
        }
    )


def test_a_laboratorys_bag_in_its_own_units_and_frame(tmp_path: Path, scene: Scene) -> None:
    turn = Rotation.from_rotvec([0.2, -0.4, 1.0])
    tissue_from_base = Pose(np.array([0.1, -0.2, 0.3]), turn.as_matrix())
    bag = laboratory(
        TRACK, frame="base", frame_from_tissue=tissue_from_base.inverse(), length=1000.0
    )
    place = {"position_m": [0.1, -0.2, 0.3], "quaternion_xyzw": turn.as_quat().tolist()}
    run = read_recording(
        bag.write(tmp_path / "lab.bag"), scene, topics(unit="mm", frames={"base": place})
    )
    arm = run.motion.arms["psm1"]
    np.testing.assert_allclose(arm.position_m, TRACK.tip_m(run.motion.time_s), atol=1e-9)
    np.testing.assert_allclose(arm.rotation[0], np.diag([1.0, -1.0, -1.0]), atol=1e-9)
    assert np.std(run.measured_m["psm1"].values[:20, 0]) == pytest.approx(2e-5, rel=0.5)
    # The jaw was opened, closed on tissue at 2 s, and opened again a second before the end.
    held = run.motion.time_s[arm.grasped]
    assert (held[0], held[-1]) == pytest.approx((2.0, 4.95))
    assert np.abs(run.clouds[0].points_m[:, 2]).max() < 0.003
    assert not run.quality.faults


def faults(run_quality: Any) -> dict[str, Any]:
    return {(fault.source, fault.kind): fault for fault in run_quality.faults}


def test_bad_rows_are_found_with_their_times_left_out_and_counted(
    tmp_path: Path, scene: Scene
) -> None:
    def spoil(topic: str, index: int, numbers: Any) -> Any:
        if topic == "/left/seen" and 10 <= index < 14:
            return np.zeros(7)
        if topic == "/left/seen" and index == 30:
            return np.full(7, np.nan)
        if topic == "/left/goal" and index == 50:
            return numbers + np.array([0.02, 0, 0, 0, 0, 0, 0])
        if topic == "/left/goal" and 80 <= index < 90:
            return None
        if topic == "/camera/points" and index == 5:
            return np.full_like(numbers, np.nan)
        return numbers

    path = laboratory(TRACK, spoil=spoil).write(tmp_path / "lab.bag")
    run = read_recording(path, scene, topics())
    found = faults(run.quality)
    zeros = found["/left/seen", "zeros"]
    assert (zeros.rows, zeros.spans_s) == (4, ((0.5, pytest.approx(0.65)),))
    assert "0.50 to 0.65 s; 4 rows left out" in zeros.sentence
    assert found["/left/seen", "not_finite"].rows == 1
    assert found["/left/goal", "outlier"].spans_s == ((2.5, 2.5),)
    assert found["/left/goal", "drop_out"].spans_s == ((pytest.approx(3.95), pytest.approx(4.5)),)
    assert found["/camera/points", "missing"].rows == 1
    assert run.quality.left_out == {"/left/seen": 5, "/left/goal": 1, "/camera/points": 1}
    assert run.quality.rows["/left/goal"] == len(TRACK.time_s) - 10
    np.testing.assert_allclose(
        run.motion.arms["psm1"].position_m, TRACK.tip_m(run.motion.time_s), atol=1e-9
    )


def test_a_frozen_camera_is_not_measured_data(tmp_path: Path, scene: Scene) -> None:
    seen: list[Any] = []

    def spoil(topic: str, index: int, numbers: Any) -> Any:
        if topic == "/camera/points":
            seen.append(numbers)
            return seen[20] if 20 <= index < 30 else numbers
        return numbers

    run = read_recording(laboratory(TRACK, spoil=spoil).write(tmp_path / "l.bag"), scene, topics())
    frozen = faults(run.quality)["/camera/points", "frozen"]
    assert (frozen.rows, frozen.spans_s) == (9, ((pytest.approx(2.1), pytest.approx(2.9)),))
    assert len(run.clouds) == 51


def test_another_clock_is_told_from_a_late_camera(tmp_path: Path, scene: Scene) -> None:
    apart = laboratory(TRACK, camera_late_s=37.2).write(tmp_path / "apart.bag")
    run = read_recording(apart, scene, topics())
    fault = faults(run.quality)["/camera/points", "clock_offset"]
    assert "37.20 s ahead of" in fault.sentence
    assert run.clouds[10].stamp_s == pytest.approx(1.0)
    late = laboratory(TRACK, camera_late_s=0.08).write(tmp_path / "late.bag")
    run = read_recording(late, scene, topics())
    assert not run.quality.faults
    assert run.clouds[10].stamp_s == pytest.approx(1.08)


@pytest.mark.parametrize(
    ("bag", "given", "says"),
    [
        ({"length": 1000.0}, {}, "looks like millimetres: give unit: mm"),
        ({"frame": "base"}, {}, "is in the frame 'base', and the topic map does not say"),
        ({"frame": ""}, {}, "names no frame"),
        ({}, {"cloud": "/nothing"}, "the cloud of the tissue should be on /nothing"),
        ({}, {"cloud": "/left/jaw"}, "/left/jaw should be of type sensor_msgs/msg/PointCloud2"),
    ],
)
def test_what_cannot_be_compared_is_refused_with_what_would_be_valid(
    bag: dict[str, Any], given: dict[str, Any], says: str, tmp_path: Path, scene: Scene
) -> None:
    path = laboratory(TRACK, **bag).write(tmp_path / "lab.bag")
    with pytest.raises(UnusableRecording, match=says):
        read_recording(path, scene, topics(**given))


def test_degrees_taken_for_radians_are_suspected(tmp_path: Path, scene: Scene) -> None:
    given = topics().model_dump()
    given["arms"]["psm1"]["jaw"]["unit"] = "rad"
    path = laboratory(TRACK).write(tmp_path / "lab.bag")
    run = read_recording(path, scene, TopicMap.model_validate(given))
    assert "give unit: deg" in faults(run.quality)["/left/jaw", "unit"].sentence.lower()


def test_a_file_that_is_no_recording(tmp_path: Path, scene: Scene) -> None:
    path = tmp_path / "text.mcap"
    path.write_text("no recording")
    with pytest.raises(UnusableRecording, match="valid are MCAP files"):
        read_recording(path, scene)


def test_a_topic_map_lists_every_fault_at_its_place(tmp_path: Path) -> None:
    path = tmp_path / "map.yaml"
    path.write_text(
        "arms:\n  psm1:\n    setpont: /goal\n"
        "cloud: {topic: /points, unit: cm}\n"
        "frames:\n  base: {position_m: [0, 0, 0], quaternion_xyzw: [1, 1, 0, 0]}\n"
    )
    with pytest.raises(InvalidFile) as refused:
        read_topic_map(path)
    told = "\n".join(str(fault) for fault in refused.value.faults)
    for said in ("map.yaml:3:5", "setpont", "map.yaml:4:", "'m' or 'mm'", "has length 1"):
        assert said in told


def test_readings_between_and_around_times() -> None:
    readings = Readings(np.array([0.0, 1.0, 2.0, 5.0]), np.array([[0.0], [2.0], [4.0], [10.0]]))
    found = readings.at(np.array([-0.1, 0.5, 3.0, 5.0, 5.1]), within_s=1.5)[:, 0]
    np.testing.assert_allclose(found, [np.nan, 1.0, np.nan, np.nan, np.nan])
    mean = readings.mean_around(np.array([1.0, 3.5]), 1.0)[:, 0]
    np.testing.assert_allclose(mean, [2.0, np.nan])
