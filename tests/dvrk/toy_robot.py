"""Arms without physics behind a transport without a wire, on a clock that the test moves."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from defras_bt.dvrk.crtk.arm import CrtkArm
from defras_bt.dvrk.settings import ArmSetup, Limits, Setup, Stream
from defras_bt.dvrk.streaming.command_log import CommandLog
from defras_bt.dvrk.streaming.drive import ArmDrive, ArmMotion
from defras_bt.dvrk.streaming.tip_stream import TipVelocity
from defras_bt.dvrk.transport.messages import (
    JointMessage,
    Message,
    PoseMessage,
    StateMessage,
    WrenchMessage,
)
from defras_sim.arm.dh import JOINT_NAMES, link_poses
from defras_sim.arm.kinematics import joints_for, tip_pose
from defras_sim.geometry import Floats, Pose

PERIOD_S = 0.01
HOME = np.array([0.1, 0.05, 0.12, 0.0, 0.1, -0.1])
BEGIN_S = 100.0


def reported(joints: Floats) -> Pose:
    """Origin of the wrist's yaw axis, turned like the tip."""
    return Pose(link_poses(joints)[-1].position_m, tip_pose(joints).rotation)


@dataclass
class ToyArm:
    """Is where it was sent to at once."""

    name: str
    setpoint: Pose = field(default_factory=lambda: reported(HOME))
    measured: Pose | None = None
    jaw_setpoint_rad: float = 0.0
    jaw_stop_rad: float = -1.0
    state: str = "ENABLED"
    is_homed: bool = True
    is_busy: bool = False
    deaf: bool = False
    joints: Floats = field(default_factory=lambda: HOME.copy())
    held: int = 0

    def servo_cp(self, pose: Pose) -> None:
        if not self.deaf and self.state == "ENABLED":
            self.setpoint = pose

    def messages(self, stamp_s: float) -> dict[str, Message]:
        base, measured = f"{self.name}_base", self.measured or self.setpoint
        jaw_rad = max(self.jaw_setpoint_rad, self.jaw_stop_rad)
        return {
            "operating_state": StateMessage(stamp_s, self.state, self.is_homed, self.is_busy),
            "measured_cp": PoseMessage(stamp_s, base, measured),
            "setpoint_cp": PoseMessage(stamp_s, base, self.setpoint),
            "local/measured_cp": PoseMessage(stamp_s, base, measured),
            "measured_js": JointMessage(stamp_s, JOINT_NAMES, self.joints),
            "setpoint_js": JointMessage(stamp_s, JOINT_NAMES, self.joints),
            "jaw/measured_js": JointMessage(stamp_s, ("jaw",), np.array([jaw_rad])),
            "jaw/setpoint_js": JointMessage(stamp_s, ("jaw",), np.array([self.jaw_setpoint_rad])),
            "body/measured_cf": WrenchMessage(stamp_s, self.name, np.array([0.0, 0.0, 0.5])),
        }

    def follow_kinematics(self) -> None:
        """Have joints that belong to the pose."""
        tip = self.setpoint @ Pose(np.array([0.0, 0.0, 0.0286]))
        self.joints = joints_for(tip, self.joints)


class ToyTransport:
    """``spoil`` may change or drop (None) any message on its way; ``sent`` lists servo_cp."""

    simulated_clock = False

    def __init__(self, *names: str) -> None:
        self.clock_s = BEGIN_S
        self.arms = {name: ToyArm(name) for name in names}
        self.receivers: defaultdict[tuple[str, str], list[Callable[[Any], object]]] = defaultdict(
            list
        )
        self.spoil: Callable[[str, str, Message], Message | None] = lambda arm, topic, said: said
        self.sent: list[tuple[float, str, Pose]] = []
        self.jaws: list[tuple[float, str, float]] = []
        self.gone = ""
        self.others: tuple[str, ...] | None = ()
        self.intruder = ""
        self.closed = False

    def listen(self, arm: str, topic: str, receive: Callable[[Any], object]) -> None:
        self.receivers[arm, topic].append(receive)

    def announce(self, arm: str) -> None:
        pass

    def servo_cp(self, arm: str, frame_from_reported: Pose, frame: str) -> None:
        assert frame == f"{arm}_base"
        self.sent.append((self.clock_s, arm, frame_from_reported))
        self.arms[arm].servo_cp(frame_from_reported)

    def servo_jaw(self, arm: str, angle_rad: float) -> None:
        self.jaws.append((self.clock_s, arm, angle_rad))
        self.arms[arm].jaw_setpoint_rad = angle_rad

    def hold(self, arm: str) -> None:
        self.arms[arm].held += 1

    def now_s(self) -> float:
        return self.clock_s

    def lost(self) -> str:
        return self.gone

    def commanders(self, arm: str) -> tuple[str, ...] | None:
        return self.others

    def overheard(self, arm: str) -> str:
        return self.intruder

    def close(self) -> None:
        self.closed = True

    def publish(self) -> None:
        """Every arm says everything once."""
        for name, arm in self.arms.items():
            for topic, said in arm.messages(self.clock_s).items():
                spoilt = self.spoil(name, topic, said)
                if spoilt is not None:
                    for receive in self.receivers[name, topic]:
                        receive(spoilt)


def toy_setup(**changes: Any) -> Setup:
    setup = Setup(
        name="toy",
        arms={
            "psm1": ArmSetup(name="PSM1", frame="PSM1_base"),
            "psm2": ArmSetup(name="PSM2", frame="PSM2_base"),
        },
    )
    return setup.model_copy(update=changes)


class DrivenArm:
    """One toy arm and its drive, a period at a time."""

    def __init__(self, stream: Stream | None = None, limits: Limits | None = None) -> None:
        self.transport = ToyTransport("PSM1")
        self.log = CommandLog()
        client = CrtkArm(toy_setup().arms["psm1"], self.transport)
        self.stream = stream or Stream()
        self.drive = ArmDrive(client, self.stream, limits or Limits(), self.log)
        for _ in range(3):
            self.period()

    @property
    def arm(self) -> ToyArm:
        return self.transport.arms["PSM1"]

    def period(self, *, silent: bool = False) -> Floats:
        """A period passes; how far the sent set-point moved in it (3,)."""
        self.transport.clock_s += PERIOD_S
        before = self.transport.sent[-1:]
        if not silent:
            self.transport.publish()
        count = len(self.transport.sent)
        self.drive.period(self.transport.clock_s, PERIOD_S, self.transport.lost())
        if len(self.transport.sent) == count or not before:
            return np.zeros(3)
        return self.transport.sent[-1][2].position_m - before[0][2].position_m

    def tick(self, velocity: Any = (0.0, 0.0, 0.0), jaw_rad: float | None = None) -> None:
        """What the executive does every five periods."""
        motion = ArmMotion(TipVelocity(np.array(velocity, float)), jaw_rad)
        self.drive.command(motion, 0.05, self.transport.clock_s)

    def go(self, ticks: int, velocity: Any = (0.0, 0.02, 0.0)) -> None:
        for _ in range(ticks):
            self.tick(velocity)
            for _ in range(5):
                self.period()


def restamped(message: Message, stamp_s: float) -> Message:
    return replace(message, stamp_s=stamp_s)
