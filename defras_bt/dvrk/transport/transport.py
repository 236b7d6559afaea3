"""What carries CRTK to and from arms. An arm is named as its topics are: "PSM1"."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from defras_sim.geometry import Pose

Receive = Callable[[Any], object]
"""Called in a thread of the transport with each message as it comes; must not wait."""


class ConnectionFailed(RuntimeError):
    """There is nobody to connect to; the message says what to do."""


class Transport(Protocol):
    """One connection to all arms of a set-up.

    ``simulated_clock``: whether the clock of the stamps is moved by a simulation, and may be slower
    than the wall's, or stand.
    """

    simulated_clock: bool

    def listen(self, arm: str, topic: str, receive: Receive) -> None:
        """Hand every message of a CRTK topic to ``receive`` from now on."""

    def announce(self, arm: str) -> None:
        """Make ready to command the arm, so that the first command is not lost."""

    def servo_cp(self, arm: str, frame_from_reported: Pose, frame: str) -> None:
        """Set the arm's Cartesian set-point. Never waits for anybody."""

    def servo_jaw(self, arm: str, angle_rad: float) -> None:
        """Set the jaw's set-point. Never waits for anybody."""

    def hold(self, arm: str) -> None:
        """Have the arm end any motion where it is."""

    def now_s(self) -> float:
        """The time on the clock that stamps the messages."""

    def lost(self) -> str:
        """Why the connection is known to be lost, in words; "" while it is not. Never waits."""

    def commanders(self, arm: str) -> tuple[str, ...] | None:
        """Who besides us announced that they command the arm; None where that cannot be known.
        May wait for an answer."""

    def overheard(self, arm: str) -> str:
        """Who else has just commanded the arm, in words, whether it obeyed or not; "" while nobody
        has, or where that cannot be known. Never waits. Listens from :meth:`announce` on."""

    def close(self) -> None:
        """Send and hear nothing more."""
