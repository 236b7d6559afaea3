"""Where a set-up's readings stand in a bag: frames and tip against a pose computed by hand."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from defras_bt.diagnosis.topic_map import read_topic_map
from defras_bt.diagnosis.topic_reader import TopicReader
from defras_bt.dvrk.registering.registration import Placed, Registration
from defras_bt.dvrk.settings import ArmSetup, Setup
from defras_bt.dvrk.topics_of import topics_of, write_topics
from defras_bt.recording.bag_reader import read_bag
from defras_sim.geometry import Pose

ROS1 = get_typestore(Stores.ROS1_NOETIC)
TISSUE_FROM_BASE = Pose(
    np.array([0.1, -0.2, 0.3]), Rotation.from_euler("xyz", [0.2, -0.1, 0.4]).as_matrix()
)
BASE_FROM_WRIST = Pose(
    np.array([0.02, 0.01, -0.1]), Rotation.from_euler("xyz", [3.0, 0.1, 0.2]).as_matrix()
)


def bag_of_one_arm(file: Path) -> Path:
    """Ten set-points of the wrist's yaw origin, in the frame of the arm's base."""
    types = ROS1.types
    x, y, z = BASE_FROM_WRIST.position_m
    qx, qy, qz, qw = BASE_FROM_WRIST.quaternion_xyzw
    kind = "geometry_msgs/msg/PoseStamped"
    with Writer(file) as bag:
        topics = [f"/PSM1/{name}" for name in ("setpoint_cp", "measured_cp", "other_cp")]
        told = [bag.add_connection(topic, kind, typestore=ROS1) for topic in topics]
        for number in range(10):
            stamp = types["builtin_interfaces/msg/Time"](sec=100 + number, nanosec=0)
            pose = types["geometry_msgs/msg/Pose"](
                position=types["geometry_msgs/msg/Point"](x=x, y=y, z=z),
                orientation=types["geometry_msgs/msg/Quaternion"](x=qx, y=qy, z=qz, w=qw),
            )
            header = types["std_msgs/msg/Header"](seq=number, stamp=stamp, frame_id="PSM1_base")
            raw = ROS1.serialize_ros1(types[kind](header=header, pose=pose), kind)
            for connection in told:
                bag.write(connection, (100 + number) * 10**9, raw)
    return file


@pytest.mark.parametrize(("reported", "beyond_m"), [("wrist", 0.0286), ("jaw", 0.0)])
def test_a_bag_of_an_arm_gives_its_tip_in_the_tissue_frame(tmp_path, reported, beyond_m):
    setup = Setup(
        name="bench", arms={"psm1": ArmSetup(name="PSM1", frame="PSM1_base", reported=reported)}
    )
    registration = Registration(
        measured=datetime(2026, 1, 1, tzinfo=UTC),
        scene="demo",
        arms={"psm1": Placed.of(TISSUE_FROM_BASE)},
    )
    file = tmp_path / "topics.yaml"
    write_topics(topics_of(setup, registration), file)
    topics = read_topic_map(file)
    bag = read_bag(bag_of_one_arm(tmp_path / "arm.bag"), topics.topics)
    assert set(bag.series) == {"/PSM1/setpoint_cp", "/PSM1/measured_cp"}
    assert bag.unread == ("/PSM1/other_cp",)
    tips = TopicReader("arm.bag", bag, topics).poses(topics.arms["psm1"].setpoint)
    wrist = TISSUE_FROM_BASE @ BASE_FROM_WRIST
    expected = wrist.apply(np.array([0.0, 0.0, beyond_m]))
    assert tips.position_m == pytest.approx(np.tile(expected, (10, 1)), abs=1e-9)
    assert tips.rotation[0] == pytest.approx(wrist.rotation, abs=1e-9)
