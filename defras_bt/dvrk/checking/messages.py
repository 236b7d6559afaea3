"""Whether messages are what they should be: names, frames, units, rates, clocks."""

from __future__ import annotations

import numpy as np

from defras_bt.dvrk.checking.bench import CheckBench
from defras_bt.dvrk.checking.finding import Finding, ok, skipped, warning, wrong
from defras_bt.dvrk.checking.watch import WATCHED
from defras_bt.dvrk.crtk.arm import CrtkArm
from defras_sim.arm.dh import INSERTION, JOINT_HIGH, JOINT_LOW, JOINT_NAMES

_FARTHEST_M = 1.0
_LATE_SHARE = 0.9
_JAW_RAD = (-0.4, 1.5)
"""A little beyond the jaw's limits, -0.349 to 1.396 rad."""


class NamesCheck:
    """Six joints in the order of the kinematics, and one jaw."""

    def run(self, bench: CheckBench) -> list[Finding]:
        return [self._one(arm) for arm in bench.arms.values()]

    def _one(self, arm: CrtkArm) -> Finding:
        joints, jaw = arm.measured_js.message, arm.jaw.message
        for said in (arm.jaw, arm.jaw_setpoint):
            if said.message is None and said.fault:
                todo = "Have the driver publish one angle in rad, with its time."
                return wrong("names", arm.name, said.fault, todo)
        if joints is None or jaw is None:
            what = "measured_js or jaw/measured_js does not come"
            return wrong("names", arm.name, what, "Have the driver publish both.")
        if joints.names != JOINT_NAMES:
            what = f"its joints are {', '.join(joints.names) or 'unnamed'}"
            return wrong("names", arm.name, what, f"They should be {', '.join(JOINT_NAMES)}.")
        return ok("names", arm.name, "six joints in their order, one jaw")


class FramesCheck:
    """Poses in the frame that was registered, soundly stamped."""

    def run(self, bench: CheckBench) -> list[Finding]:
        findings = []
        for arm in bench.arms.values():
            if arm.faults():
                todo = "Correct arms.*.frame in the set-up, or the driver; then register anew."
                findings += [wrong("frames", arm.name, fault, todo) for fault in arm.faults()]
            elif arm.measured_cp.message is None or arm.setpoint_cp.message is None:
                what = "measured_cp or setpoint_cp does not come"
                findings.append(wrong("frames", arm.name, what, "Have the driver publish both."))
            else:
                frame = arm.measured_cp.message.frame
                findings.append(ok("frames", arm.name, f"poses come in {frame}"))
        return findings


class UnitsCheck:
    """Metres and radians: of another unit, numbers are a thousand times or sixty times off."""

    def run(self, bench: CheckBench) -> list[Finding]:
        return [self._one(arm) for arm in bench.arms.values()]

    def _one(self, arm: CrtkArm) -> Finding:
        pose, joints, jaw = (
            arm.measured_cp.message,
            arm.measured_js.message,
            arm.jaw.message,
        )
        if pose is None or joints is None or jaw is None or len(joints.position) != 6:
            what = "poses, six joints and a jaw are needed to judge units"
            return wrong("units", arm.name, what, "See the findings about names and frames.")
        away_m = float(np.linalg.norm(pose.pose.position_m))
        if not away_m < _FARTHEST_M:
            what = f"its tip would be {away_m:.3g} m away from its frame's origin"
            return wrong("units", arm.name, what, "Publish metres (CRTK).")
        margin = 0.02 * (JOINT_HIGH - JOINT_LOW)
        outside = (joints.position < JOINT_LOW - margin) | (joints.position > JOINT_HIGH + margin)
        if outside.any():
            index = int(np.flatnonzero(outside)[0])
            unit = "m" if index == INSERTION else "rad"
            what = (
                f"{JOINT_NAMES[index]} is {joints.position[index]:.3g}, which no PSM reaches "
                f"({JOINT_LOW[index]:g} to {JOINT_HIGH[index]:g} {unit})"
            )
            return wrong("units", arm.name, what, "Publish metres and radians (CRTK).")
        low, high = _JAW_RAD
        if not low <= float(jaw.position[0]) <= high:
            what = f"its jaw stands at {float(jaw.position[0]):.3g}, beyond {low:g} to {high:g} rad"
            return wrong("units", arm.name, what, "Publish radians, 0 for closed, more for open.")
        return ok("units", arm.name, "metres and radians within an arm's reach")


class RateCheck:
    """Every topic as often as the set-up expects; without two messages in the age that is allowed,
    motion would wait again and again."""

    def run(self, bench: CheckBench) -> list[Finding]:
        usual_hz = bench.setup.rates.measured_hz
        least_hz = 2.0 / bench.setup.limits.arm_age_s
        findings = []
        for name, arm in bench.arms.items():
            rates = {topic: bench.watches[name].rate_hz(topic) for topic in WATCHED}
            slow = {t: hz for t, hz in rates.items() if hz < _LATE_SHARE * usual_hz}
            if slow:
                what = "; ".join(f"{topic} comes at {hz:.0f} Hz" for topic, hz in slow.items())
                todo = (
                    f"{usual_hz:g} Hz are usual and {least_hz:g} Hz needed: raise the driver's "
                    "rate (-p 0.01), or free this computer."
                )
                grade = wrong if min(slow.values()) < least_hz else warning
                findings.append(grade("rates", arm.name, what, todo))
            else:
                findings.append(
                    ok("rates", arm.name, f"everything comes at {min(rates.values()):.0f} Hz")
                )
        return findings


class ClockCheck:
    """The robot's clock beside ours, and how long messages are on their way."""

    def run(self, bench: CheckBench) -> list[Finding]:
        findings = []
        for name, arm in bench.arms.items():
            if bench.transport.simulated_clock:
                what = "time is a simulation's: there is no second clock to compare"
                findings.append(skipped("clock", arm.name, what))
                continue
            delays_s = bench.watches[name].delays_s("measured_cp")
            if len(delays_s) < 10:
                what = "too few messages to compare clocks"
                findings.append(wrong("clock", arm.name, what, "See the findings about rates."))
                continue
            fastest_s = float(delays_s.min())
            # By a clock that is ahead messages come before they were sent: that is not their way.
            slow_s = float(np.quantile(delays_s, 0.99)) - min(fastest_s, 0.0)
            findings.append(self._offset(bench, arm, fastest_s))
            findings.append(self._latency(bench, arm, slow_s))
        return findings

    def _offset(self, bench: CheckBench, arm: CrtkArm, fastest_s: float) -> Finding:
        limit_s = bench.setup.limits.clock_offset_s
        if abs(fastest_s) <= limit_s:
            what = f"clocks agree within {abs(fastest_s) * 1e3:.1f} ms"
            return ok("clock", arm.name, what)
        side = "behind" if fastest_s > 0.0 else "ahead of"
        what = f"its clock is {abs(fastest_s) * 1e3:.0f} ms {side} this computer's"
        todo = f"Keep both clocks in step (chrony or ptp); {limit_s * 1e3:g} ms are allowed."
        return wrong("clock", arm.name, what, todo)

    def _latency(self, bench: CheckBench, arm: CrtkArm, slow_s: float) -> Finding:
        limit_s = bench.setup.limits.arm_age_s
        what = f"99 of 100 messages are here within {slow_s * 1e3:.1f} ms"
        if slow_s <= limit_s / 2:
            return ok("latency", arm.name, what)
        todo = (
            f"Motion waits whenever one is older than {limit_s * 1e3:g} ms: free this computer, or "
            "use a direct cable."
        )
        if slow_s <= limit_s:
            return warning("latency", arm.name, what, todo)
        return wrong("latency", arm.name, what, todo)
