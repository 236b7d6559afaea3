from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import McapReader
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from defras_bt.recording.bag import BagRecorder
from defras_bt.recording.bag_reader import read_bag
from defras_bt.recording.mcap_file import is_cut_off, recover_mcap
from defras_bt.recording.record import RunSummary
from tests.recording.synthetic_run import SyntheticRun

ARM_TOPICS = (
    "measured_cp",
    "setpoint_cp",
    "measured_js",
    "setpoint_js",
    "jaw/measured_js",
    "grasped",
)
TOPICS = {f"/PSM{i}/{topic}" for i in (1, 2) for topic in ARM_TOPICS} | {
    "/tissue/points",
    "/endoscope/roi_visibility",
    "/executive/setup",
    "/executive/inputs",
}


def write(run: SyntheticRun, path: Path) -> Path:
    recorder = BagRecorder(path)
    recorder.start(run.info)
    for record in run.ticks():
        recorder.tick(record)
    recorder.finish(RunSummary({}))
    return path


@pytest.fixture(scope="module")
def run(short_run: SyntheticRun) -> SyntheticRun:
    return replace(short_run, duration_s=4.0)


@pytest.fixture(scope="module")
def bag_file(tmp_path_factory: pytest.TempPathFactory, run: SyntheticRun) -> Path:
    return write(run, tmp_path_factory.mktemp("bag") / "recording.mcap")


def test_topics_and_types_by_an_independent_reader(bag_file: Path, run: SyntheticRun) -> None:
    with Reader(bag_file) as reader:
        types = {connection.topic: connection.msgtype for connection in reader.connections}
        times = [at for _, at, _ in reader.messages()]
        assert reader.message_count == len(times) == sum(c.msgcount for c in reader.connections)
    assert set(types) == TOPICS
    assert types["/PSM1/measured_cp"] == "geometry_msgs/msg/PoseStamped"
    assert types["/tissue/points"] == "sensor_msgs/msg/PointCloud2"
    assert times == sorted(times)
    assert times[-1] == 4_000_000_000


def test_rerun_reads_it_too(bag_file: Path) -> None:
    assert {chunk.entity_path for chunk in McapReader(bag_file).stream().to_chunks()} >= TOPICS


def test_poses_and_joints_come_back(bag_file: Path, run: SyntheticRun) -> None:
    bag = read_bag(bag_file)
    arms = [record.observation.arms["psm1"] for record in run.ticks()]
    poses = bag["/PSM1/measured_cp"]
    assert poses.frame_id == "tissue"
    np.testing.assert_allclose(poses.stamp_s, [arm.stamp_s for arm in arms], atol=1e-9)
    expected = [(*a.tissue_from_tip.position_m, *a.tissue_from_tip.quaternion_xyzw) for a in arms]
    np.testing.assert_allclose(poses.values, expected)
    joints = bag["/PSM1/setpoint_js"]
    assert joints.columns == ("yaw", "pitch", "insertion", "roll", "wrist_pitch", "wrist_yaw")
    np.testing.assert_allclose(joints.values, [arm.setpoint_joints for arm in arms])
    np.testing.assert_array_equal(bag["/PSM1/grasped"].values[:, 0], [arm.grasped for arm in arms])
    assert bag.skipped == ()


def test_each_cloud_is_written_once(bag_file: Path, run: SyntheticRun) -> None:
    clouds = [r.observation.cloud for r in run.ticks() if r.tick % 2 == 0]
    series = read_bag(bag_file)["/tissue/points"]
    assert len(series.points_m) == len(clouds)
    for read, cloud in zip(series.points_m, clouds, strict=True):
        assert cloud is not None
        np.testing.assert_allclose(read, cloud.points_m, atol=1e-8)


def test_a_stale_reading_keeps_its_stamp(tmp_path: Path, run: SyntheticRun) -> None:
    first = run.ticks()[0]
    late = replace(first, tick=1, time_s=0.3)
    recorder = BagRecorder(tmp_path / "r.mcap")
    recorder.start(run.info)
    cloud = first.observation.cloud
    assert cloud is not None
    seen = replace(first.observation, cloud=replace(cloud, stamp_s=0.1), roi_visibility=None)
    recorder.tick(replace(late, observation=seen))
    recorder.finish(RunSummary({}))
    bag = read_bag(tmp_path / "r.mcap")
    assert (bag["/tissue/points"].time_s[0], bag["/tissue/points"].stamp_s[0]) == (0.3, 0.1)
    with pytest.raises(KeyError, match=r"no topic /endoscope/roi_visibility; the bag has /PSM1"):
        bag["/endoscope/roi_visibility"]


def test_a_killed_process_loses_at_most_a_second(tmp_path: Path, run: SyntheticRun) -> None:
    path = tmp_path / "killed.mcap"
    child = os.fork()
    if child == 0:
        recorder = BagRecorder(path)
        recorder.start(run.info)
        for record in run.ticks():
            recorder.tick(record)
        os.kill(os.getpid(), 9)
    os.waitpid(child, 0)
    assert is_cut_off(path)
    assert read_bag(path)["/PSM2/measured_cp"].time_s[-1] == pytest.approx(4.0, abs=1.0)


def test_a_torn_file_is_recovered_to_its_last_whole_chunk(tmp_path: Path, bag_file: Path) -> None:
    content = bag_file.read_bytes()
    torn = tmp_path / "torn.mcap"
    torn.write_bytes(content[: len(content) // 2])
    saved = recover_mcap(torn, tmp_path / "saved.mcap")
    with Reader(tmp_path / "saved.mcap") as reader:
        assert reader.message_count == saved > 100
    with pytest.raises(ValueError, match="does not begin like an MCAP file"):
        recover_mcap(Path(__file__), tmp_path / "no.mcap")


def test_a_run_without_joints_or_grasp_sensor(tmp_path: Path, run: SyntheticRun) -> None:
    recorder = BagRecorder(tmp_path / "r.mcap")
    recorder.start(run.info)
    first = run.ticks()[0]
    arm = replace(first.observation.arms["psm1"], joints=None, setpoint_joints=None, grasped=None)
    recorder.tick(replace(first, observation=replace(first.observation, arms={"psm1": arm})))
    recorder.finish(RunSummary({}))
    kept = {t for t in read_bag(tmp_path / "r.mcap").series if t.startswith("/PSM")}
    assert kept == {"/PSM1/measured_cp", "/PSM1/setpoint_cp", "/PSM1/jaw/measured_js"}


def test_a_measured_force_is_a_wrench_of_the_tissue_frame(
    tmp_path: Path, run: SyntheticRun
) -> None:
    recorder = BagRecorder(tmp_path / "r.mcap")
    recorder.start(run.info)
    first = run.ticks()[0]
    arm = replace(first.observation.arms["psm1"], force_n=np.array([0.01, -0.02, 0.3]))
    recorder.tick(replace(first, observation=replace(first.observation, arms={"psm1": arm})))
    recorder.finish(RunSummary({}))
    felt = read_bag(tmp_path / "r.mcap")["/PSM1/body/measured_cf"]
    assert felt.message_type == "geometry_msgs/msg/WrenchStamped"
    assert felt.frame_id == "tissue"
    assert felt.values.tolist() == [[0.01, -0.02, 0.3, 0.0, 0.0, 0.0]]


def test_a_ros_1_bag_is_read_and_strangers_are_named(tmp_path: Path) -> None:
    store = get_typestore(Stores.ROS1_NOETIC)
    types = store.types
    stamp = types["builtin_interfaces/msg/Time"](sec=12, nanosec=500_000_000)
    header = types["std_msgs/msg/Header"](seq=1, stamp=stamp, frame_id="PSM1_base")
    jaw = types["sensor_msgs/msg/JointState"](header, ["jaw"], np.array([0.3]), *[np.zeros(0)] * 2)
    with Ros1Writer(tmp_path / "lab.bag") as writer:
        for topic, message in (
            ("/PSM1/jaw/measured_js", jaw),
            ("/colour", types["std_msgs/msg/ColorRGBA"](1.0, 0.0, 0.0, 1.0)),
        ):
            kind = message.__msgtype__
            connection = writer.add_connection(topic, kind, typestore=store)
            writer.write(connection, 13_000_000_000, store.serialize_ros1(message, kind))
    bag = read_bag(tmp_path / "lab.bag")
    series = bag["/PSM1/jaw/measured_js"]
    assert (series.time_s[0], series.stamp_s[0], series.values[0, 0]) == (13.0, 12.5, 0.3)
    assert series.frame_id == "PSM1_base"
    assert bag.skipped == (("/colour", "std_msgs/msg/ColorRGBA"),)
