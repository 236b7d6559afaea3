"""Whether the arms could move, and whether nobody else moves them."""

from __future__ import annotations

from defras_bt.dvrk.checking.bench import CheckBench
from defras_bt.dvrk.checking.finding import Finding, ok, skipped, wrong
from defras_bt.dvrk.crtk.arm import NotFresh
from defras_bt.dvrk.streaming.drive import QUIET_M


class StateCheck:
    """ENABLED, homed and not busy."""

    def run(self, bench: CheckBench) -> list[Finding]:
        findings = []
        for arm in bench.arms.values():
            try:
                state = arm.state()
            except NotFresh as silent:
                todo = f"Start the driver of {arm.name}, or correct arms' names in the set-up."
                findings.append(wrong("state", arm.name, str(silent), todo))
                continue
            if state.state != "ENABLED":
                todo = "Enable the arm (power on, and clear what caused a FAULT)."
                what = f"is {state.state}; only an ENABLED arm moves"
            elif not state.is_homed:
                todo, what = "Home the arm.", "is not homed"
            elif state.is_busy:
                todo = "Wait until the motion is over, or end the program that asked for it."
                what = "carries out a motion that somebody else asked for"
            else:
                findings.append(ok("state", arm.name, "is ENABLED, homed and idle"))
                continue
            findings.append(wrong("state", arm.name, what, todo))
        return findings


class CommandersCheck:
    """Two programs that command one arm are never right."""

    def run(self, bench: CheckBench) -> list[Finding]:
        findings = []
        for arm in bench.arms.values():
            others = bench.transport.commanders(arm.name)
            if others is None:
                what = "this transport does not tell who else commands the arm"
                findings.append(skipped("commanders", arm.name, what))
            elif others:
                what = f"is also commanded by {', '.join(others)}"
                todo = (
                    "End that program: only one may command an arm. If it was killed, rosnode "
                    "cleanup makes the master forget it."
                )
                findings.append(wrong("commanders", arm.name, what, todo))
            else:
                findings.append(ok("commanders", arm.name, "nobody else commands it"))
        return findings


class RestCheck:
    """An arm that is told nothing stays where it is."""

    def run(self, bench: CheckBench) -> list[Finding]:
        findings = []
        for name, arm in bench.arms.items():
            moved_m = bench.watches[name].moved_m
            if moved_m > QUIET_M:
                what = f"its set-point moved by {moved_m * 1e3:.1f} mm while it was told nothing"
                todo = "End teleoperation and every other program that moves the arm."
                findings.append(wrong("rest", arm.name, what, todo))
            else:
                findings.append(ok("rest", arm.name, "stays where it is"))
        return findings
