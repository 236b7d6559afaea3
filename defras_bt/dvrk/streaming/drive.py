"""One arm as it is driven: its stream, its supervisor and its echo, a period at a time."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from defras_bt.dvrk.crtk.arm import CrtkArm
from defras_bt.dvrk.settings import Limits, Stream
from defras_bt.dvrk.streaming.command_log import CommandLog
from defras_bt.dvrk.streaming.echo import Echo
from defras_bt.dvrk.streaming.jaw_stream import JawStream
from defras_bt.dvrk.streaming.supervisor import Standing, Supervisor
from defras_bt.dvrk.streaming.tip_stream import TipStream, TipVelocity
from defras_bt.dvrk.transport.messages import (
    JointMessage,
    PoseMessage,
    StateMessage,
    WrenchMessage,
)
from defras_sim.geometry import Pose

QUIET_M = 3e-4
"""A set-point that moves farther in 0.3 s while nothing is sent here is moved by somebody else."""
_AFTERWARDS_S = 0.5
"""So long the echo may still show what was sent here before the stream ended."""


@dataclass(frozen=True)
class ArmMotion:
    """What one arm does in the coming tick: the tip's velocity, and where the jaw goes, as its
    driver counts (None: nowhere)."""

    velocity: TipVelocity = field(default_factory=TipVelocity)
    jaw_rad: float | None = None


@dataclass(frozen=True)
class ArmSnapshot:
    """One arm as it was last heard; ``setpoint`` is of the moment of ``measured``. ``goal``:
    frame_from_tip that it was last told to go to, None while nothing is sent. ``stopped``: why it
    is not driven, in words."""

    measured: PoseMessage | None
    setpoint: PoseMessage | None
    joints: JointMessage | None
    setpoint_joints: JointMessage | None
    jaw: JointMessage | None
    jaw_setpoint: JointMessage | None
    wrench: WrenchMessage | None
    state: StateMessage | None
    goal: Pose | None
    stopped: str


class ArmDrive:
    """Nothing is sent before the first command, and nothing while a trip lasts: an arm whose stream
    ends holds its last set-point and its grip. Then it starts anew from where the arm says that it
    stands.
    """

    def __init__(self, arm: CrtkArm, stream: Stream, limits: Limits, log: CommandLog) -> None:
        self.arm = arm
        self._stream = stream
        self._log = log
        self._supervisor = Supervisor(arm, limits)
        self._reported_to_tip = Pose(np.array([0.0, 0.0, arm.setup.reported_to_tip_m]))
        self._tip_to_reported = self._reported_to_tip.inverse()
        self._echo = Echo(limits.echo_m, limits.echo_rad, self._applied)
        self._tip: TipStream | None = None
        self._jaw: JawStream | None = None
        self._ends_s = self._ended_s = float("-inf")
        self._told = ""
        self.standing = Standing(f"{arm.name}: was not looked at yet")
        """What the supervisor said in the latest period."""

    @property
    def engaged(self) -> bool:
        """Whether set-points are being sent."""
        return self._tip is not None or self._jaw is not None

    def command(self, motion: ArmMotion | None, tick_s: float, now_s: float) -> None:
        """A new tick: move so; None stops the tip where it is and leaves the jaw as it is."""
        self._ends_s = now_s + self._stream.watchdog_s
        motion = motion or ArmMotion()
        if self.standing.trip or self._told:
            return
        if self._tip is None and motion.velocity.moves:
            setpoint = self.arm.setpoint_cp.message
            if setpoint is not None:
                self._tip = TipStream(self._stream, setpoint.pose @ self._reported_to_tip)
        if self._tip is not None:
            self._tip.command(motion.velocity, tick_s)
        if motion.jaw_rad is not None:
            self._pursue_jaw(motion.jaw_rad)

    def period(
        self, now_s: float, elapsed_s: float, lost: str, *, others_stopped: bool = False
    ) -> bool:
        """Send the next set-points, if any may be sent; returns whether any was.

        ``others_stopped``: another arm of the set-up must not be driven now. Nobody can say what
        that means for this one, so it stands still until somebody decides.
        """
        setpoint = self.arm.setpoint_cp.message
        if setpoint is not None:
            self._echo.heard(setpoint.stamp_s, setpoint.pose)
        self.standing = self._judge(now_s, lost)
        if self.standing.trip:
            self._trip(self.standing.trip, now_s)
            return False
        if now_s > self._ends_s:
            self._stop_by_itself()
        waits = others_stopped or bool(self.standing.wait)
        if self._tip is not None:
            if waits:
                self._tip.wait()
            else:
                self._tip.step(elapsed_s)
            pose = self._tip.pose @ self._tip_to_reported
            self.arm.servo_cp(pose)
            self._echo.sent(now_s, pose)
            self._log.sent(self.arm.name, now_s, pose)
        if self._jaw is not None and not waits:
            self.arm.servo_jaw(self._jaw.step(elapsed_s))
        return self.engaged

    def end(self, now_s: float) -> None:
        """Send nothing more; the arm holds."""
        if self._tip is not None:
            self._ended_s = now_s
        self._tip = self._jaw = None
        self._echo.restart()

    def snapshot(self) -> ArmSnapshot:
        """The arm as last heard. A trip is told at least once, however short it was."""
        arm = self.arm
        told, self._told = self._told or self.standing.trip, ""
        measured = arm.measured_cp.message
        return ArmSnapshot(
            measured,
            None if measured is None else arm.setpoint_cp.at(measured.stamp_s),
            arm.measured_js.message,
            arm.setpoint_js.message,
            arm.jaw.message,
            arm.jaw_setpoint.message,
            arm.wrench.message,
            arm.operating_state.message,
            None if self._tip is None else self._tip.goal,
            told,
        )

    def _judge(self, now_s: float, lost: str) -> Standing:
        standing = self._supervisor.judge(now_s, lost)
        if standing.trip:
            return standing
        fault = self._echo.fault
        # A jaw that is streamed moves no tip.
        still = self._tip is None and now_s - self._ended_s > _AFTERWARDS_S
        if not fault and still and self._echo.moved_m > QUIET_M:
            fault = "is moved by somebody else: its set-point changes while nothing is sent here"
        return Standing(f"{self.arm.name} {fault}" if fault else "", standing.wait)

    def _trip(self, why: str, now_s: float) -> None:
        if self.engaged:
            # Another client's motion ends as well: two that drive one arm are never right.
            self.arm.hold()
        self._told = self._told or why
        self.end(now_s)

    def _stop_by_itself(self) -> None:
        """Nobody commands any more: what moves stops, what is gripped stays gripped."""
        if self._tip is not None and self._tip.moving:
            self._tip.stop()
        if self._jaw is not None:
            self._jaw.stop()

    def _pursue_jaw(self, jaw_rad: float) -> None:
        if self._jaw is None:
            start = self.arm.jaw_setpoint.message or self.arm.jaw.message
            if start is None:
                return
            self._jaw = JawStream(self._stream.jaw_rad_s, float(start.position[0]))
        self._jaw.pursue(jaw_rad)

    def _applied(self, sent_s: float, applied_s: float) -> None:
        self._log.applied(self.arm.name, sent_s, applied_s)
