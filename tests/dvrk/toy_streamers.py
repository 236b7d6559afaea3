"""Two toy arms that stream JSON over UDP in real time, as sawSocketStreamer does."""

from __future__ import annotations

import json
import socket
from collections.abc import Mapping
from threading import Event, Thread
from time import monotonic, sleep
from typing import Any

import numpy as np

from defras_bt.dvrk.transport.messages import (
    JointMessage,
    Message,
    PoseMessage,
    StateMessage,
    WrenchMessage,
)
from defras_sim.geometry import Pose
from tests.dvrk.toy_robot import ToyArm

_PERIOD_S = 0.01


def said_as_json(message: Message) -> Mapping[str, Any]:
    """The message as the streamer writes it."""
    stamp: dict[str, Any] = {"Timestamp": message.stamp_s, "Valid": True}
    if isinstance(message, PoseMessage):
        place = {
            "Rotation": message.pose.rotation.tolist(),
            "Translation": message.pose.position_m.tolist(),
        }
        return {**stamp, "Position": place, "ReferenceFrame": message.frame}
    if isinstance(message, JointMessage):
        return {**stamp, "Name": list(message.names), "Position": message.position.tolist()}
    if isinstance(message, StateMessage):
        flags = {"IsHomed": message.is_homed, "IsBusy": message.is_busy}
        return {**stamp, "State": message.state, **flags}
    assert isinstance(message, WrenchMessage)
    return {**stamp, "Force": message.force_n.tolist(), "ReferenceFrame": message.frame}


class ToyStreamers:
    """Streams every arm to its port until it is closed."""

    def __init__(self, ports: Mapping[str, int]) -> None:
        self.arms = {name: ToyArm(name) for name in ports}
        self._ports = ports
        self._sockets = {name: socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for name in ports}
        for own in self._sockets.values():
            own.setblocking(False)
        self._end = Event()
        self._begin_s = monotonic() - 5.0
        self._thread = Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._end.set()
        self._thread.join()
        for own in self._sockets.values():
            own.close()

    def _run(self) -> None:
        while not self._end.is_set():
            for name, arm in self.arms.items():
                self._obey(arm, self._sockets[name])
                for topic, message in arm.messages(monotonic() - self._begin_s).items():
                    data = json.dumps({topic: said_as_json(message)}).encode()
                    self._sockets[name].sendto(data, ("127.0.0.1", self._ports[name]))
            sleep(_PERIOD_S)

    def _obey(self, arm: ToyArm, own: socket.socket) -> None:
        while True:
            try:
                content = json.loads(own.recv(4096))
            except BlockingIOError:
                return
            if "servo_cp" in content:
                goal = content["servo_cp"]["Goal"]
                arm.servo_cp(Pose(np.array(goal["Translation"]), np.array(goal["Rotation"])))
            elif "jaw/servo_jp" in content:
                arm.jaw_setpoint_rad = content["jaw/servo_jp"]["Goal"][0]
            elif "hold" in content:
                arm.held += 1


def free_ports(count: int) -> list[int]:
    """UDP ports of the loopback that nobody uses."""
    sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(count)]
    try:
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]
    finally:
        for one in sockets:
            one.close()
