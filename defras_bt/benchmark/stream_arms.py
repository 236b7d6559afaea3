"""Two arms without physics that stream as sawSocketStreamer does, in a program of their own.

``python -m defras_bt.benchmark.stream_arms PORT PORT``: they are wherever they were sent, and say
so at 100 Hz. Enough to measure a stream of set-points against.
"""

from __future__ import annotations

import json
import socket
import sys
from time import monotonic, sleep

_PERIOD_S = 0.01
_START = {
    "Rotation": [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]],
    "Translation": [-0.02, -0.02, -0.11],
}
"""base_from_reported at home, the jaw pointing down."""


class StreamedArm:
    """One arm and its port."""

    def __init__(self, name: str, port: int) -> None:
        self._base = f"{name}_base"
        self._to = ("127.0.0.1", port)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._place = _START
        self._jaw_rad = 0.0

    def obey(self) -> None:
        """Take what has come since the last period."""
        while True:
            try:
                said = json.loads(self._socket.recv(4096))
            except (BlockingIOError, ConnectionRefusedError):
                return
            if "servo_cp" in said:
                self._place = said["servo_cp"]["Goal"]
            elif "jaw/servo_jp" in said:
                self._jaw_rad = said["jaw/servo_jp"]["Goal"][0]

    def speak(self, stamp_s: float) -> None:
        """Send everything once."""
        stamp = {"Timestamp": stamp_s, "Valid": True}
        pose = {**stamp, "Position": self._place, "ReferenceFrame": self._base}
        jaw = {**stamp, "Name": ["jaw"], "Position": [self._jaw_rad]}
        state = {**stamp, "State": "ENABLED", "IsHomed": True, "IsBusy": False}
        for topic, said in (
            ("measured_cp", pose),
            ("setpoint_cp", pose),
            ("jaw/measured_js", jaw),
            ("jaw/setpoint_js", jaw),
            ("operating_state", state),
        ):
            self._socket.sendto(json.dumps({topic: said}).encode(), self._to)


def stream(ports: list[int]) -> None:
    """Stream until the program is ended."""
    arms = [StreamedArm(f"PSM{number + 1}", port) for number, port in enumerate(ports)]
    begin_s = due_s = monotonic()
    while True:
        due_s = max(due_s + _PERIOD_S, monotonic())
        sleep(max(0.0, due_s - monotonic()))
        for arm in arms:
            arm.obey()
            arm.speak(monotonic() - begin_s + 1.0)


if __name__ == "__main__":
    stream([int(port) for port in sys.argv[1:]])
