"""CRTK as JSON over UDP, as sawSocketStreamer speaks it: a port of ours for each arm.

A streamer sends one message a datagram, ``{"measured_cp": {...}}``, to the port that its file
names; commands go back to where the last one came from. What it must be configured to send and
take stands in the documentation (``docs/dvrk.md``). Its stamps are seconds since it was started.

Format: github.com/jhu-saw/sawSocketStreamer, and sawIntuitiveResearchKit ``share/socket-streamer``.
"""

from __future__ import annotations

import json
import socket
from collections import defaultdict
from collections.abc import Mapping
from threading import Lock, Thread
from time import monotonic
from typing import Any

import numpy as np

from defras_bt.dvrk.transport.messages import (
    JOINTS,
    POSES,
    STATES,
    WRENCHES,
    JointMessage,
    Message,
    PoseMessage,
    StateMessage,
    WrenchMessage,
)
from defras_bt.dvrk.transport.streamer_clock import StreamerClock
from defras_bt.dvrk.transport.transport import ConnectionFailed, Receive
from defras_sim.geometry import Pose

_LONGEST_BYTES = 65_535
_WAIT_S = 0.2


class StreamerSocket:
    """One UDP socket and one listening thread per arm."""

    simulated_clock = False

    def __init__(self, ports: Mapping[str, int], own_address: str = "127.0.0.1") -> None:
        """``ports``: of ours, by the arm's name; 0 lets the system choose one.

        Raises:
            ConnectionFailed: a port is taken.
        """
        self._clock = StreamerClock()
        self._clock_lock = Lock()
        self._receivers: defaultdict[tuple[str, str], list[Receive]] = defaultdict(list)
        self._peers: dict[str, Any] = {}
        self._ended = False
        self.unreadable = 0
        """Datagrams that made no sense."""
        self._sockets: dict[str, socket.socket] = {}
        for arm, port in ports.items():
            own = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self._sockets[arm] = own
            try:
                own.bind((own_address, port))
            except OSError as error:
                self.close()
                raise ConnectionFailed(
                    f"cannot listen to {arm} on {own_address}:{port} ({error}); is another "
                    "program listening there?"
                ) from error
            own.settimeout(_WAIT_S)
        self._threads = [
            Thread(target=self._hear, args=(arm, own), name=f"hears {arm}", daemon=True)
            for arm, own in self._sockets.items()
        ]
        for thread in self._threads:
            thread.start()

    def port(self, arm: str) -> int:
        """Where the streamer of ``arm`` has to send to."""
        return int(self._sockets[arm].getsockname()[1])

    def listen(self, arm: str, topic: str, receive: Receive) -> None:
        self._receivers[arm, topic].append(receive)

    def announce(self, arm: str) -> None:
        pass  # commands are simply sent

    def servo_cp(self, arm: str, frame_from_reported: Pose, frame: str) -> None:
        goal = {
            "Rotation": frame_from_reported.rotation.tolist(),
            "Translation": frame_from_reported.position_m.tolist(),
        }
        self._send(arm, {"servo_cp": {"Goal": goal}})

    def servo_jaw(self, arm: str, angle_rad: float) -> None:
        self._send(arm, {"jaw/servo_jp": {"Goal": [angle_rad]}})

    def hold(self, arm: str) -> None:
        self._send(arm, {"hold": ""})

    def now_s(self) -> float:
        return self._clock.at(monotonic())

    def lost(self) -> str:
        # UDP has no connection: only silence tells, and whoever listens judges that by age.
        return ""

    def commanders(self, arm: str) -> tuple[str, ...] | None:
        return None

    def overheard(self, arm: str) -> str:
        return ""

    def close(self) -> None:
        self._ended = True
        for own in self._sockets.values():
            own.close()

    def _send(self, arm: str, content: Mapping[str, Any]) -> None:
        peer = self._peers.get(arm)
        if peer is not None and not self._ended:
            self._sockets[arm].sendto(json.dumps(content).encode(), peer)

    def _hear(self, arm: str, own: socket.socket) -> None:
        while not self._ended:
            try:
                datagram, peer = own.recvfrom(_LONGEST_BYTES)
            except TimeoutError:
                continue
            except OSError:
                return  # closed
            received_s = monotonic()
            try:
                messages = [
                    (topic, read(topic, said)) for topic, said in json.loads(datagram).items()
                ]
            except (ValueError, KeyError, TypeError, AttributeError):
                self.unreadable += 1
                continue
            self._peers[arm] = peer
            for topic, message in messages:
                if message.stamp_s > 0.0:
                    with self._clock_lock:
                        self._clock.heard(message.stamp_s, received_s)
                for receive in tuple(self._receivers[arm, topic]):
                    receive(message)


def read(topic: str, said: Mapping[str, Any]) -> Message:
    """The message of a CRTK topic from its JSON.

    What the sender itself marks as not valid gets the stamp 0, which nobody acts on.

    Raises:
        KeyError: a field, or the topic itself, is not known.
        ValueError: a field has another form.
    """
    stamp_s = float(said["Timestamp"]) if said.get("Valid", True) else 0.0
    if topic in POSES:
        place = said["Position"]
        pose = Pose(
            np.array(place["Translation"], float).reshape(3),
            np.array(place["Rotation"], float).reshape(3, 3),
        )
        return PoseMessage(stamp_s, str(said["ReferenceFrame"]), pose)
    if topic in JOINTS:
        return JointMessage(
            stamp_s,
            tuple(said["Name"] or ()),
            np.array(said["Position"] or [], float),
            np.array(said.get("Velocity") or [], float),
        )
    if topic in STATES:
        return StateMessage(
            stamp_s, str(said["State"]), bool(said["IsHomed"]), bool(said["IsBusy"])
        )
    if topic in WRENCHES:
        force_n = np.array(said["Force"], float)[:3].reshape(3)
        return WrenchMessage(stamp_s, str(said.get("ReferenceFrame", "")), force_n)
    raise KeyError(topic)
