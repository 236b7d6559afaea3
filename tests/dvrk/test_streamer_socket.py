"""CRTK as JSON over UDP, with a toy that streams as sawSocketStreamer does."""

from __future__ import annotations

import json
import socket
from time import monotonic, sleep
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from defras_bt.dvrk.transport.messages import JointMessage, PoseMessage, StateMessage
from defras_bt.dvrk.transport.streamer_clock import StreamerClock
from defras_bt.dvrk.transport.streamer_socket import StreamerSocket, read
from defras_bt.dvrk.transport.transport import ConnectionFailed
from defras_sim.geometry import Pose

# As the documentation of sawIntuitiveResearchKit's socket streamer shows it, with a PSM's names.
POSE = {
    "AutomaticTimestamp": False,
    "MovingFrame": "PSM1",
    "Position": {
        "Rotation": [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
        "Translation": [-0.001, -0.36, -0.12],
    },
    "ReferenceFrame": "PSM1_base",
    "Timestamp": 19.699,
    "Valid": True,
}
JAW = {"Effort": None, "Name": ["jaw"], "Position": [0.3], "Timestamp": 19.7, "Valid": True}


class TestReading:
    """What the streamer's JSON means."""

    def test_a_pose(self) -> None:
        said = read("measured_cp", POSE)
        assert isinstance(said, PoseMessage)
        assert (said.stamp_s, said.frame) == (19.699, "PSM1_base")
        np.testing.assert_array_equal(said.pose.position_m, [-0.001, -0.36, -0.12])
        np.testing.assert_array_equal(said.pose.rotation @ [0, 1, 0], [1, 0, 0])

    def test_joints_without_velocities(self) -> None:
        said = read("jaw/measured_js", JAW)
        assert isinstance(said, JointMessage)
        assert said.names == ("jaw",)
        assert len(said.velocity) == 0

    def test_a_state(self) -> None:
        state = {"State": "PAUSED", "IsHomed": True, "IsBusy": False, "Timestamp": 3.0}
        assert read("operating_state", state) == StateMessage(3.0, "PAUSED", True, False)

    def test_what_the_sender_marks_as_not_valid_has_no_stamp(self) -> None:
        assert read("measured_cp", {**POSE, "Valid": False}).stamp_s == 0.0

    def test_an_unknown_topic(self) -> None:
        with pytest.raises(KeyError):
            read("measured_cv", POSE)


class TestClock:
    """The sender's clock, seen through its messages."""

    def test_the_fastest_message_counts(self) -> None:
        clock = StreamerClock()
        rng = np.random.default_rng(0)
        for stamp_s in np.arange(5.0, 8.0, 0.01):
            clock.heard(float(stamp_s), float(stamp_s) + 1000.0 + rng.uniform(0.0002, 0.02))
        assert clock.at(1010.0) == pytest.approx(10.0, abs=1e-3)

    def test_a_delay_that_begins_shows_as_age(self) -> None:
        clock = StreamerClock()
        for stamp_s in np.arange(5.0, 8.0, 0.01):
            clock.heard(float(stamp_s), float(stamp_s) + 1000.0)
        clock.heard(8.0, 1008.25)
        assert clock.at(1008.25) - 8.0 == pytest.approx(0.25, abs=1e-3)

    def test_before_anything_was_heard(self) -> None:
        assert StreamerClock().at(5.0) == float("-inf")


class ToyStreamer:
    """One arm's streamer on the loopback."""

    def __init__(self, port: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.settimeout(2.0)
        self._to = ("127.0.0.1", port)

    def send(self, content: Any) -> None:
        data = content if isinstance(content, bytes) else json.dumps(content).encode()
        self._socket.sendto(data, self._to)

    def receive(self) -> Any:
        return json.loads(self._socket.recv(4096))

    def close(self) -> None:
        self._socket.close()


@pytest.fixture
def transport():
    transport = StreamerSocket({"PSM1": 0})
    yield transport
    transport.close()


@pytest.fixture
def streamer(transport: StreamerSocket):
    streamer = ToyStreamer(transport.port("PSM1"))
    yield streamer
    streamer.close()


def heard(transport: StreamerSocket, topic: str) -> list[Any]:
    messages: list[Any] = []
    transport.listen("PSM1", topic, messages.append)
    return messages


def wait_for(messages: list[Any], count: int = 1) -> None:
    until_s = monotonic() + 5.0
    while len(messages) < count and monotonic() < until_s:
        sleep(0.005)
    assert len(messages) >= count


def test_messages_come_and_commands_go_back(
    transport: StreamerSocket, streamer: ToyStreamer
) -> None:
    poses, jaws = heard(transport, "measured_cp"), heard(transport, "jaw/measured_js")
    streamer.send({"measured_cp": POSE, "jaw/measured_js": JAW})
    wait_for(jaws)
    assert poses[0].frame == "PSM1_base"
    turn = Rotation.from_rotvec([0.1, 0.2, 0.3]).as_matrix()
    transport.servo_cp("PSM1", Pose(np.array([0.01, 0.02, -0.1]), turn), "PSM1_base")
    goal = streamer.receive()["servo_cp"]["Goal"]
    assert goal["Translation"] == [0.01, 0.02, -0.1]
    np.testing.assert_array_equal(goal["Rotation"], turn)
    transport.servo_jaw("PSM1", 0.4)
    assert streamer.receive() == {"jaw/servo_jp": {"Goal": [0.4]}}
    transport.hold("PSM1")
    assert streamer.receive() == {"hold": ""}


def test_time_goes_on_between_messages(transport: StreamerSocket, streamer: ToyStreamer) -> None:
    poses = heard(transport, "measured_cp")
    streamer.send({"measured_cp": POSE})
    wait_for(poses)
    sleep(0.05)
    assert 19.74 <= transport.now_s() < 25.0


def test_nonsense_is_counted_and_does_no_harm(
    transport: StreamerSocket, streamer: ToyStreamer
) -> None:
    poses = heard(transport, "measured_cp")
    for nonsense in (b"\xff\xfe", b"{", b"[1, 2]", {"measured_cp": {}}, {"measured_cp": 3}):
        streamer.send(nonsense)
    streamer.send({"measured_cp": POSE})
    wait_for(poses)
    assert transport.unreadable == 5


def test_before_the_arm_is_heard_nothing_is_sent(transport: StreamerSocket) -> None:
    transport.hold("PSM1")  # there is no address to send it to


def test_a_port_that_is_taken(transport: StreamerSocket) -> None:
    with pytest.raises(ConnectionFailed, match="is another program listening"):
        StreamerSocket({"PSM1": transport.port("PSM1")})
