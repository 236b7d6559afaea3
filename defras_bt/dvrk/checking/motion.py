"""2 mm along each axis and back: does the arm go where it is told, and no farther?

This is the only check that moves anything. It drives the arm as the executive does, through the
same stream with the same limits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import sleep
from typing import Protocol

import numpy as np

from defras_bt.dvrk.arm_frames import ArmFrames
from defras_bt.dvrk.checking.finding import Finding, ok, wrong
from defras_bt.dvrk.streaming.drive import ArmMotion, ArmSnapshot
from defras_bt.dvrk.streaming.servo_loop import Servo, Tick
from defras_bt.dvrk.streaming.tip_stream import TipVelocity
from defras_sim.geometry import Floats

STROKE_M = 0.002
TICK_S = 0.05
SPEED_M_S = 0.01
JAW_STROKE_RAD = 0.1
_SETTLE_S = 0.5
_SCALE = 0.2
"""A measured stroke may be this share longer or shorter than the one commanded."""
_ASIDE_M = 0.0006
_STILL_TICKS = 2
_AXES = {"x": np.array([1.0, 0.0, 0.0]), "y": np.array([0.0, 1.0, 0.0]), "z": np.array([0, 0, 1.0])}


class Stopped(RuntimeError):
    """The arm stopped, or nothing is heard of it; the message says why."""


class SeesTool(Protocol):
    """A camera's own idea of where a tool went."""

    def look(self, tip_m: Floats) -> None:
        """Remember how the tool looks whose tip is at ``tip_m`` (3,), tissue frame."""

    def moved_m(self, tip_m: Floats) -> Floats | None:
        """Displacement (3,) since then, tissue frame; None where the tool is not seen."""


@dataclass(frozen=True)
class Stroke:
    """Tissue frame, (3,) each: what was commanded, what encoders and what the camera saw."""

    commanded_m: Floats
    measured_m: Floats
    seen_m: Floats | None


class MotionCheck:
    """Moves one arm after the other. ``pause`` lets time pass between ticks."""

    def __init__(
        self,
        servo: Servo,
        frames: dict[str, ArmFrames],
        names: dict[str, str],
        camera: SeesTool | None = None,
        pause: Callable[[float], None] = sleep,
    ) -> None:
        self._servo, self._frames, self._names = servo, frames, names
        self._camera = camera
        self._pause = pause

    def run(self) -> list[Finding]:
        """Findings of all arms; the first arm that does something else than told ends the check."""
        findings: list[Finding] = []
        for arm, name in self._names.items():
            try:
                findings += self._axes(arm, name)
                if not any(one.grade == "wrong" for one in findings):
                    findings.append(self._jaw(arm, name))
            except Stopped as stopped:
                todo = "Clear the reason, and check again."
                findings.append(wrong("motion", name, str(stopped), todo))
            self._servo.command(Tick({}, TICK_S))
            if any(one.grade == "wrong" for one in findings):
                break
        return findings

    def _axes(self, arm: str, name: str) -> list[Finding]:
        findings = []
        for axis, way in _AXES.items():
            there = self._stroke(arm, way)
            back = self._stroke(arm, -way)
            findings.append(judged(name, axis, there))
            if findings[-1].grade == "ok":
                findings[-1] = judged(name, axis, back) if _poor(back) else findings[-1]
            if findings[-1].grade == "ok" and self._camera is not None:
                findings.append(judged_by_camera(name, axis, there))
            if findings[-1].grade == "wrong":
                break
        return findings

    def _stroke(self, arm: str, way: Floats) -> Stroke:
        frames = self._frames[arm]
        before_m = self._tip_m(arm)
        if self._camera is not None:
            self._camera.look(before_m)
        ticks = round(STROKE_M / (SPEED_M_S * TICK_S))
        velocity = frames.velocity(SPEED_M_S * way, np.zeros(3))
        for _ in range(ticks):
            self._servo.command(Tick({arm: ArmMotion(velocity)}, TICK_S))
            self._pause(TICK_S)
            self._heard(arm)
        # A velocity of zero would cut off what is left of the last tick.
        self._pause(_STILL_TICKS * TICK_S)
        self._servo.command(Tick({arm: ArmMotion(TipVelocity())}, TICK_S))
        self._pause(_SETTLE_S)
        after_m = self._tip_m(arm)
        seen_m = None if self._camera is None else self._camera.moved_m(after_m)
        return Stroke(STROKE_M * way, after_m - before_m, seen_m)

    def _jaw(self, arm: str, name: str) -> Finding:
        """Open a little and back; a jaw of the wrong sign closes instead."""
        before_rad = self._jaw_rad(arm)
        opened_rad = self._jaw_at(arm, before_rad + JAW_STROKE_RAD) - before_rad
        self._jaw_at(arm, before_rad)
        if abs(opened_rad - JAW_STROKE_RAD) <= 0.3 * JAW_STROKE_RAD:
            return ok("jaw", name, f"opened by {opened_rad:.2f} rad when told {JAW_STROKE_RAD:g}")
        what = f"its jaw turned by {opened_rad:+.2f} rad when told {JAW_STROKE_RAD:+g}"
        todo = "Opening must count positive (CRTK); see the driver's tool file, or free the jaw."
        return wrong("jaw", name, what, todo)

    def _jaw_at(self, arm: str, goal_rad: float) -> float:
        """Send the jaw to ``goal_rad``; where it is some time later."""
        for _ in range(round(_SETTLE_S / TICK_S)):
            self._servo.command(Tick({arm: ArmMotion(jaw_rad=goal_rad)}, TICK_S))
            self._pause(TICK_S)
        return self._jaw_rad(arm)

    def _tip_m(self, arm: str) -> Floats:
        measured = self._heard(arm).measured
        if measured is None:
            raise Stopped(f"{self._names[arm]} does not say where it is")
        return self._frames[arm].tissue_from_tip(measured.pose).position_m

    def _jaw_rad(self, arm: str) -> float:
        jaw = self._heard(arm).jaw
        if jaw is None:
            raise Stopped(f"{self._names[arm]} does not say where its jaw is")
        return float(jaw.position[0])

    def _heard(self, arm: str) -> ArmSnapshot:
        snapshot = self._servo.snapshot()
        seen = snapshot.arms[arm]
        if snapshot.broke or seen.stopped:
            raise Stopped(snapshot.broke or seen.stopped)
        return seen


def judged(name: str, axis: str, stroke: Stroke) -> Finding:
    """What encoders say of a stroke."""
    along_m, aside_m = _parts(stroke.commanded_m, stroke.measured_m)
    what = f"{along_m * 1e3:+.2f} mm along {axis} when told {STROKE_M * 1e3:g}"
    if not _poor(stroke):
        return ok("motion", name, f"moved {what}, {aside_m * 1e3:.2f} mm aside")
    scale = along_m / STROKE_M
    if scale < -0.5:
        hint = "it went the other way: frames of servo_cp and measured_cp differ"
    elif scale < 0.2 and aside_m < _ASIDE_M:
        hint = "it hardly moved: are motors on, and does it hear servo_cp?"
    elif aside_m >= _ASIDE_M:
        hint = f"it went {aside_m * 1e3:.1f} mm aside: frames of servo_cp and measured_cp differ"
    else:
        hint = "it went too far or too short: units, or set-points are applied twice"
    return wrong("motion", name, f"moved {what}; {hint}", "Do not operate; mend the driver first.")


def judged_by_camera(name: str, axis: str, stroke: Stroke) -> Finding:
    """What the depth camera says of a stroke: it tells whether the registrations agree."""
    if stroke.seen_m is None:
        what = f"the depth camera does not see the tool well enough to follow it along {axis}"
        return Finding(check="seen", about=name, grade="skipped", what=what)
    along_m, aside_m = _parts(stroke.commanded_m, stroke.seen_m)
    what = (
        f"the depth camera saw {along_m * 1e3:+.1f} mm along {axis} and {aside_m * 1e3:.1f} mm "
        f"aside when told {STROKE_M * 1e3:g}"
    )
    if along_m >= 0.4 * STROKE_M and aside_m <= 0.6 * STROKE_M:
        return ok("seen", name, what)
    todo = "Arm and camera are not registered to the same frame: register both anew."
    return wrong("seen", name, what, todo)


def _poor(stroke: Stroke) -> bool:
    along_m, aside_m = _parts(stroke.commanded_m, stroke.measured_m)
    return abs(along_m - STROKE_M) > _SCALE * STROKE_M or aside_m > _ASIDE_M


def _parts(commanded_m: Floats, found_m: Floats) -> tuple[float, float]:
    """How far along the commanded way, and how far aside of it."""
    unit = commanded_m / np.linalg.norm(commanded_m)
    along_m = float(found_m @ unit)
    return along_m, float(np.linalg.norm(found_m - along_m * unit))
