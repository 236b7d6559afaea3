"""CRTK over a real ROS 1 master, within this process."""

from __future__ import annotations

import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from defras_bt.dvrk.ros_packages import ros_module
from defras_bt.dvrk.settings import Ros1Transport
from defras_bt.dvrk.stand_in.ros_master import RosMaster
from defras_bt.dvrk.transport import ros1_node
from defras_bt.dvrk.transport.crtk_messages import crtk_messages
from defras_bt.dvrk.transport.lifeline import Lifeline
from defras_bt.dvrk.transport.messages import JointMessage, PoseMessage, StateMessage
from defras_bt.dvrk.transport.ros1 import Ros1
from defras_bt.dvrk.transport.ros1_node import address, join, node_lives
from defras_bt.dvrk.transport.transport import ConnectionFailed
from defras_sim.geometry import Pose

POSE = Pose(np.array([0.01, -0.02, -0.12]), Rotation.from_rotvec([0.3, -0.2, 2.0]).as_matrix())


class Wire:
    """Both ends of every topic of one arm whose name nobody else uses."""

    def __init__(self, master: RosMaster) -> None:
        settings = Ros1Transport(master_uri=master.uri, own_address="127.0.0.1")
        self.rospy = join(settings, "judge")
        self.transport = Ros1(settings)

    def publish(self, topic: str, message: Any) -> Any:
        """Publish until the transport has heard it; what it heard.

        Heard apart from other topics, whose last messages may still be on their way.
        """
        heard: list[Any] = []
        self.transport.listen("PSM9", topic, heard.append)
        out = self.rospy.Publisher(f"/PSM9/{topic}", type(message), queue_size=5)
        try:
            return self.wait_for(lambda: out.publish(message), heard)
        finally:
            out.unregister()

    def wait_for(self, again: Any, heard: list[Any]) -> Any:
        until_s = monotonic() + 10.0
        while not heard and monotonic() < until_s:
            again()
            sleep(0.02)
        assert heard
        return heard[0]


@pytest.fixture
def wire(ros_master: RosMaster) -> Iterator[Wire]:
    wire = Wire(ros_master)
    yield wire
    # Not closed: that would end this process's only node.
    for one in wire.transport._subscribers:
        one.unregister()


def test_a_pose_comes_as_it_was_sent(wire: Wire) -> None:
    message = ros_module("geometry_msgs.msg").PoseStamped()
    message.header.frame_id = "PSM9_base"
    message.header.stamp = wire.rospy.Time(12, 250_000_000)
    place, turn = message.pose.position, message.pose.orientation
    place.x, place.y, place.z = POSE.position_m
    turn.x, turn.y, turn.z, turn.w = POSE.quaternion_xyzw
    said = wire.publish("measured_cp", message)
    assert isinstance(said, PoseMessage)
    assert (said.stamp_s, said.frame) == (12.25, "PSM9_base")
    np.testing.assert_allclose(said.pose.position_m, POSE.position_m)
    np.testing.assert_allclose(said.pose.rotation, POSE.rotation, atol=1e-12)


def test_a_pose_without_rotation_is_not_taken_for_one(wire: Wire) -> None:
    said = wire.publish("setpoint_cp", ros_module("geometry_msgs.msg").PoseStamped())
    assert np.isnan(said.pose.rotation).all()


def test_joints_and_state(wire: Wire) -> None:
    jaw = ros_module("sensor_msgs.msg").JointState(name=["jaw"], position=[0.3])
    said = wire.publish("jaw/measured_js", jaw)
    assert isinstance(said, JointMessage)
    assert said.names == ("jaw",)
    state = wire.publish("operating_state", crtk_messages().OperatingState(state="FAULT"))
    assert isinstance(state, StateMessage)
    assert (state.state, state.is_homed) == ("FAULT", False)


def test_commands_reach_whoever_listens(wire: Wire) -> None:
    goals: list[Any] = []
    kind = ros_module("geometry_msgs.msg").PoseStamped
    listener = wire.rospy.Subscriber("/PSM9/servo_cp", kind, goals.append)
    wire.transport.announce("PSM9")
    goal = wire.wait_for(lambda: wire.transport.servo_cp("PSM9", POSE, "PSM9_base"), goals)
    listener.unregister()
    assert goal.header.frame_id == "PSM9_base"
    assert goal.header.stamp.to_sec() > 0.0
    assert [goal.pose.position.x, goal.pose.position.z] == pytest.approx([0.01, -0.12])


def test_who_else_commands(wire: Wire, ros_master: RosMaster) -> None:
    assert wire.transport.commanders("PSM9") == (), "not counting ourselves"
    assert wire.transport.overheard("PSM9") == "", "not counting ourselves"
    assert not node_lives(ros_master.uri, "/nobody")
    assert node_lives(ros_master.uri, wire.rospy.get_name())


_STRANGER = """
import sys
from time import sleep
from defras_bt.dvrk.ros_packages import ros_module
from defras_bt.dvrk.settings import Ros1Transport
from defras_bt.dvrk.transport.ros1_node import join
rospy = join(Ros1Transport(master_uri=sys.argv[1], own_address="127.0.0.1"), "forgotten")
joints = ros_module("sensor_msgs.msg").JointState
out = rospy.Publisher("/PSM9/move_jr", joints, queue_size=1)
while True:
    out.publish(joints(position=[0.0] * 6))
    sleep(0.02)
"""


def test_a_stranger_who_commands_is_overheard_until_it_ends(
    wire: Wire, ros_master: RosMaster
) -> None:
    wire.transport.announce("PSM9")
    stranger = subprocess.Popen([sys.executable, "-c", _STRANGER, ros_master.uri])
    try:
        _until(lambda: bool(wire.transport.overheard("PSM9")))
        who = wire.transport.overheard("PSM9")
        assert who.startswith("/forgotten")
        assert who.endswith("commands it as well (move_jr)")
        assert wire.transport.overheard("PSM8") == ""
    finally:
        stranger.kill()
        stranger.wait()
    _until(lambda: not wire.transport.overheard("PSM9"))


def _until(true: Callable[[], bool]) -> None:
    until_s = monotonic() + 20.0
    while not true():
        assert monotonic() < until_s
        sleep(0.01)


@pytest.mark.parametrize(
    ("error", "lives"),
    [
        (ConnectionRefusedError("refused"), False),
        (socket.gaierror("Name or service not known"), True),
        (TimeoutError("timed out"), True),
    ],
)
def test_only_a_refusal_proves_that_a_node_is_dead(
    error: OSError, lives: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Master:
        def lookupNode(self, caller: str, node: str) -> tuple[int, str, str]:
            return 1, "", "http://console:40000"

    def unreachable(where: tuple[str, int], timeout_s: float) -> socket.socket:
        assert where == ("console", 40000)
        raise error

    monkeypatch.setattr(ros1_node, "ServerProxy", lambda uri: Master())
    monkeypatch.setattr("socket.create_connection", unreachable)
    assert node_lives("http://robot:11311", "/teleop") is lives


def test_a_living_master_is_not_lost(wire: Wire) -> None:
    assert wire.transport.lost() == ""


def test_an_unknown_topic(wire: Wire) -> None:
    with pytest.raises(ValueError, match="valid are measured_cp, setpoint_cp"):
        wire.transport.listen("PSM9", "measured_jp", print)


def test_one_process_has_one_master(wire: Wire) -> None:
    with pytest.raises(ConnectionFailed, match="cannot join http://localhost:1 as well"):
        join(Ros1Transport(master_uri="http://localhost:1"), "other")


def test_no_master_at_all(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    rospy = ros_module("rospy")
    monkeypatch.setattr(rospy.core, "is_initialized", lambda: False)
    with pytest.raises(ConnectionFailed, match="start roscore there"):
        join(Ros1Transport(master_uri=f"http://127.0.0.1:{port}"), "other")


def test_a_master_that_is_killed_is_known_at_once(tmp_path: Path) -> None:
    with RosMaster(tmp_path / "ros") as master:
        lifeline = Lifeline(*address(master.uri))
        sleep(0.3)
        assert not lifeline.cut
        master.kill()
        until_s = monotonic() + 5.0
        while not lifeline.cut and monotonic() < until_s:
            sleep(0.005)
        assert lifeline.cut
    lifeline.close()
