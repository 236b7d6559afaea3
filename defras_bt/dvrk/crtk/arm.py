"""One patient-side manipulator: what it says, and commands to it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from typing import Generic, TypeVar

from defras_bt.dvrk.crtk.newest import Newest
from defras_bt.dvrk.settings import ArmSetup
from defras_bt.dvrk.transport.messages import (
    JointMessage,
    PoseMessage,
    StateMessage,
    WrenchMessage,
)
from defras_bt.dvrk.transport.transport import Transport
from defras_sim.geometry import Floats, Pose

Value = TypeVar("Value")
TIME_OUT_S = 0.1
"""Older than this, a reading says nothing about now: ten periods of a dVRK's messages."""


class NotFresh(RuntimeError):
    """A reading is missing or too old; the message says which, and how old."""


@dataclass(frozen=True)
class Stamped(Generic[Value]):
    """A reading, when it was measured on the robot's clock, and its age when it was asked for."""

    value: Value
    stamp_s: float
    age_s: float


class CrtkArm:
    """Client of one arm. Getters raise :class:`NotFresh` on readings older than ``time_out_s``.

    ``measured_cp`` and the others are :class:`Newest`, for those who judge ages themselves.
    """

    def __init__(
        self, setup: ArmSetup, transport: Transport, time_out_s: float = TIME_OUT_S
    ) -> None:
        self.setup = setup
        self._transport = transport
        self._time_out_s = time_out_s
        self.measured_cp = self._heard("measured_cp", PoseMessage, setup.frame)
        self.setpoint_cp = self._heard("setpoint_cp", PoseMessage, setup.frame)
        self.local_cp = self._heard("local/measured_cp", PoseMessage)
        self.measured_js = self._heard("measured_js", JointMessage)
        self.setpoint_js = self._heard("setpoint_js", JointMessage)
        self.jaw = self._heard("jaw/measured_js", JointMessage, unsound=_no_jaw)
        self.jaw_setpoint = self._heard("jaw/setpoint_js", JointMessage, unsound=_no_jaw)
        self.wrench = self._heard("body/measured_cf", WrenchMessage)
        self.operating_state = self._heard("operating_state", StateMessage)

    @property
    def name(self) -> str:
        return self.setup.name

    def pose(self) -> Stamped[Pose]:
        """frame_from_reported, measured."""
        fresh = self._fresh(self.measured_cp, "measured_cp")
        return Stamped(fresh.value.pose, fresh.stamp_s, fresh.age_s)

    def setpoint_pose(self) -> Stamped[Pose]:
        """frame_from_reported that the arm says it was sent to."""
        fresh = self._fresh(self.setpoint_cp, "setpoint_cp")
        return Stamped(fresh.value.pose, fresh.stamp_s, fresh.age_s)

    def joints(self) -> Stamped[Floats]:
        """Yaw, pitch [rad], insertion [m], roll, wrist pitch, wrist yaw [rad], measured (6,)."""
        fresh = self._fresh(self.measured_js, "measured_js")
        return Stamped(fresh.value.position, fresh.stamp_s, fresh.age_s)

    def jaw_rad(self) -> Stamped[float]:
        """Opening of the jaw, measured."""
        fresh = self._fresh(self.jaw, "jaw/measured_js")
        return Stamped(float(fresh.value.position[0]), fresh.stamp_s, fresh.age_s)

    def state(self) -> StateMessage:
        """The operating state last heard: many drivers publish it only when it changes.

        Raises:
            NotFresh: none was ever heard.
        """
        if self.operating_state.message is None:
            raise NotFresh(f"{self.name} has not said yet what state it is in (operating_state)")
        return self.operating_state.message

    def is_busy(self, since_s: float) -> bool:
        """Whether the arm carries out a motion that was asked for at ``since_s`` of its clock.

        Only a state stamped strictly later can tell; until one comes, the arm counts as busy.
        """
        state = self.operating_state.message
        return state is None or state.stamp_s <= since_s or state.is_busy

    def servo_cp(self, frame_from_reported: Pose) -> None:
        """Set the set-point; it must be within one step of the one before."""
        self._transport.servo_cp(self.name, frame_from_reported, self.setup.frame)

    def servo_jaw(self, angle_rad: float) -> None:
        self._transport.servo_jaw(self.name, angle_rad)

    def hold(self) -> None:
        """End any motion, whoever commands it."""
        self._transport.hold(self.name)

    def overheard(self) -> str:
        """Who else has just commanded the arm, in words; "" where nobody is known to have."""
        return self._transport.overheard(self.name)

    def faults(self) -> tuple[str, ...]:
        """What is wrong with messages that still come, one sentence a topic."""
        heard = (
            *(self.measured_cp, self.setpoint_cp),
            *(self.jaw, self.jaw_setpoint, self.operating_state),
        )
        return tuple(one.fault for one in heard if one.fault)

    def _fresh(self, heard: Newest[AnyOf], topic: str) -> Stamped[AnyOf]:
        age_s = heard.age_s()
        if heard.message is None:
            raise NotFresh(heard.fault or f"{self.name} has not sent any {topic} yet")
        if not age_s <= self._time_out_s:
            raise NotFresh(
                f"the last {topic} of {self.name} is {age_s:.3f} s old; at most "
                f"{self._time_out_s:g} s is allowed{f' ({heard.fault})' if heard.fault else ''}"
            )
        return Stamped(heard.message, heard.message.stamp_s, age_s)

    def _heard(
        self,
        topic: str,
        kind: type[AnyOf],
        frame: str = "",
        unsound: Callable[[AnyOf], str] = lambda message: "",
    ) -> Newest[AnyOf]:
        newest: Newest[AnyOf] = Newest(
            f"{topic} of {self.name}", self._transport.now_s, frame, unsound
        )
        self._transport.listen(self.name, topic, newest.offer)
        return newest


AnyOf = TypeVar("AnyOf", PoseMessage, JointMessage, StateMessage, WrenchMessage)


def _no_jaw(said: JointMessage) -> str:
    """Why ``said`` cannot be of a jaw; what is sent to a jaw begins at what it says."""
    if len(said.position) != 1:
        return f"has {len(said.position)} joints; a jaw has one angle"
    if not isfinite(said.position[0]):
        return f"is {said.position[0]}, which is not an angle"
    return ""
