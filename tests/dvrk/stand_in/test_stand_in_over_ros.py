"""The stand-in over a real ROS 1 master, as a client of CRTK sees it."""

import json
from collections.abc import Callable
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import numpy as np
import pytest

from defras_bt.dvrk.cameras.ros1_cameras import Ros1Cameras
from defras_bt.dvrk.registering.registration import read_registration
from defras_bt.dvrk.ros_packages import ros_module
from defras_bt.dvrk.settings import load_setup
from defras_bt.dvrk.stand_in.fault_topic import FAULT_TOPIC
from defras_bt.dvrk.transport.crtk_messages import crtk_messages
from defras_bt.dvrk.transport.ros1_node import join
from defras_sim.resources import resource
from defras_sim.scene import load_scene


class Ear:
    """Keeps every message of one topic."""

    def __init__(self, rospy: Any, topic: str, kind: Any) -> None:
        self.heard: list[Any] = []
        self._subscriber = rospy.Subscriber(topic, kind, self.heard.append, tcp_nodelay=True)

    def wait(
        self,
        what: Callable[[Any], bool] = lambda _: True,
        within_s: float = 10.0,
        since: int | None = None,
    ) -> Any:
        """The first message that is so, of those yet to come or of those after the first ``since``.

        An answer may be here before a test that only just sent something asks for it: such a test
        counts with ``len(ear.heard)`` before it sends.
        """
        seen, begun_s = len(self.heard) if since is None else since, monotonic()
        while monotonic() - begun_s < within_s:
            fresh = self.heard[seen:]
            if found := [message for message in fresh if what(message)]:
                return found[0]
            sleep(0.005)
        raise AssertionError(f"nothing of the kind within {within_s} s")


def test_arms_cameras_and_faults_as_a_client_meets_them(ros_master, start_stand_in, tmp_path: Path):
    lab, witness = tmp_path / "lab", tmp_path / "witness.jsonl"
    quiet = ("--world", "model", "--imperfections", "none")
    running = start_stand_in("demo", *quiet, "--set-up", str(lab), "--witness", str(witness))
    setup = load_setup(lab / "dvrk.yaml")
    registration = read_registration(lab / "registration.yaml")
    rospy = join(setup.transport, "test")
    geometry, sensor = ros_module("geometry_msgs.msg"), ros_module("sensor_msgs.msg")
    std, crtk = ros_module("std_msgs.msg"), crtk_messages()
    measured = Ear(rospy, "/PSM1/measured_cp", geometry.PoseStamped)
    setpoint = Ear(rospy, "/PSM1/setpoint_cp", geometry.PoseStamped)
    state = Ear(rospy, "/PSM1/operating_state", crtk.OperatingState)
    error = Ear(rospy, "/PSM1/error", crtk.StringStamped)
    jaw = Ear(rospy, "/PSM1/jaw/measured_js", sensor.JointState)

    def out(topic: str, kind: Any) -> Any:
        publisher = rospy.Publisher(topic, kind, queue_size=1, tcp_nodelay=True)
        while publisher.get_num_connections() == 0:
            sleep(0.01)
        return publisher

    servo, move_jaw = (
        out("/PSM1/servo_cp", geometry.PoseStamped),
        out("/PSM1/jaw/move_jp", sensor.JointState),
    )

    # Where the scene has the arm at the start, the reported point is, 28.6 mm behind the tip.
    scene = load_scene(resource("sim/scenes/demo.yaml"))
    base = registration.arms["psm1"].pose
    start = measured.wait()
    expected = np.array(scene.arms["psm1"].home_tip_m) - base.position_m + [0, 0, 0.0286]
    at = start.pose.position
    assert [at.x, at.y, at.z] == pytest.approx(expected, abs=1e-6)
    assert start.header.frame_id == setup.arms["psm1"].frame

    # A goal within a step is the set-point at once; one beyond is refused, in words.
    goal = setpoint.wait()
    goal.pose.position.x += 0.0005
    servo.publish(goal)
    setpoint.wait(lambda m: abs(m.pose.position.x - goal.pose.position.x) < 1e-9, 2.0)
    goal.pose.position.x += 0.02
    before = len(error.heard)
    servo.publish(goal)
    assert "one period's motion" in error.wait(since=before).string

    # Moves of the jaw raise is_busy; every state is stamped after the one before.
    before = len(state.heard)
    move_jaw.publish(sensor.JointState(position=[0.8]))
    busy = state.wait(lambda m: m.is_busy, since=before)
    assert busy.state == "ENABLED"
    state.wait(lambda m: not m.is_busy, since=state.heard.index(busy))
    assert jaw.wait(lambda m: m.position[0] > 0.75).name == ["jaw"]
    stamps = [m.header.stamp.to_sec() for m in state.heard]
    assert np.all(np.diff(stamps) > 0)

    # Cloud and visibility as the registration has them.
    poses = {name: placed.pose for name, placed in registration.cameras.items()}
    cameras = Ros1Cameras(setup.cameras, poses, scene)
    since_s = monotonic()
    while cameras.latest().cloud is None or cameras.latest().roi_visibility is None:
        assert monotonic() - since_s < 10.0
        sleep(0.05)
    readings = cameras.latest()
    assert np.median(np.abs(readings.cloud.points_m[:, 2])) < 0.0005
    assert readings.roi_visibility == pytest.approx(0.0, abs=0.02)
    assert cameras.now_s() >= readings.cloud.stamp_s
    assert readings.faults == {}

    # Faults on order: an arm that is paused moves no more; a cloud in millimetres is not used.
    faults = out(FAULT_TOPIC, std.String)
    changes, refusals = len(state.heard), len(error.heard)
    faults.publish("{fault: paused, arm: psm1, duration_s: 0.5}")
    paused = state.wait(lambda m: m.state == "PAUSED", since=changes)
    servo.publish(setpoint.wait())
    assert "PAUSED" in error.wait(since=refusals).string
    state.wait(lambda m: m.state == "ENABLED", since=state.heard.index(paused))
    # A second client commands over ROS as everybody does.
    foreign = Ear(rospy, "/PSM1/servo_cp", geometry.PoseStamped)
    was_m = setpoint.wait().pose.position.x
    faults.publish("{fault: second_client, arm: psm1, speed_m_s: 0.01, duration_s: 0.5}")
    stranger = foreign.wait()
    assert stranger._connection_header["callerid"] != rospy.get_name()
    setpoint.wait(lambda m: m.pose.position.x > was_m + 0.002)
    told_at_once: list[float] = []
    cameras.when_unusable(lambda: told_at_once.append(monotonic()))
    faults.publish("{fault: millimetres}")
    since_s = monotonic()
    while "millimetres" not in cameras.latest().faults.get("cloud", ""):
        assert monotonic() - since_s < 10.0
        sleep(0.05)
    assert len(told_at_once) == 1
    cameras.close()

    assert running.end() == 0
    told = [json.loads(line) for line in witness.read_text().splitlines()]
    goals = [t for t in told if t["event"] == "goal" and t["command"] == "servo_cp"]
    assert any("by" in t and "refused" not in t for t in goals)
    goals = [t for t in goals if "by" not in t]
    assert [bool(t.get("refused")) for t in goals] == [False, True, True]
    turns = [t["fault"] for t in told if t["event"] == "fault"]
    # The stand-in may be ended before its second client is.
    assert turns[:3] == ["paused", "paused", "second_client"]
    assert set(turns) == {"paused", "second_client", "millimetres"}
