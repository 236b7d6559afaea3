"""All checks of a laboratory, in the order in which they make sense."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from time import monotonic, sleep

from defras_bt.dvrk.arm_frames import ArmFrames
from defras_bt.dvrk.checking.arm_state import CommandersCheck, RestCheck, StateCheck
from defras_bt.dvrk.checking.bench import Check, CheckBench
from defras_bt.dvrk.checking.cameras import CameraCheck
from defras_bt.dvrk.checking.computer import DiskCheck
from defras_bt.dvrk.checking.finding import Finding, ok, warning, wrong
from defras_bt.dvrk.checking.messages import (
    ClockCheck,
    FramesCheck,
    NamesCheck,
    RateCheck,
    UnitsCheck,
)
from defras_bt.dvrk.checking.motion import MotionCheck, Stopped
from defras_bt.dvrk.checking.registered import RegistrationCheck
from defras_bt.dvrk.checking.seen_tool import SeenTool
from defras_bt.dvrk.checking.tip import TipCheck
from defras_bt.dvrk.checking.watch import Watch
from defras_bt.dvrk.checking.whole_cloud import WholeCloud
from defras_bt.dvrk.checking.workspace import WorkspaceCheck
from defras_bt.dvrk.crtk.arm import CrtkArm
from defras_bt.dvrk.laboratory import NotRegistered, open_cameras, registered
from defras_bt.dvrk.settings import Setup
from defras_bt.dvrk.streaming.servo_loop import StreamReport
from defras_bt.dvrk.streaming.servo_process import ServoLost, ServoProcess
from defras_bt.dvrk.transport.connect import connect
from defras_bt.dvrk.transport.ros1 import Ros1
from defras_sim.scene import Scene

CHECKS: tuple[Check, ...] = (
    StateCheck(),
    NamesCheck(),
    FramesCheck(),
    UnitsCheck(),
    TipCheck(),
    RateCheck(),
    ClockCheck(),
    CommandersCheck(),
    RestCheck(),
    RegistrationCheck(),
    WorkspaceCheck(),
    CameraCheck(),
    DiskCheck(),
)
"""Checks that move nothing."""

LISTEN_S = 4.0
_CONNECT_S = 2.0
_LOOK_EVERY_S = 0.05
_P99_SHARE = 0.2
_CLOCK_STANDS_S = 10.0
_HEARD_S = 15.0


@contextmanager
def check_bench(
    setup: Setup, scene: Scene, out: Path, listening: Callable[[], object] = lambda: None
) -> Iterator[CheckBench]:
    """Listen to everything for some seconds; what was connected is closed at the end.
    ``listening`` is called when everybody has answered.

    Raises:
        NotRegistered: arms or cameras are not registered, or the set-up lacks an arm of ``scene``.
        RosMissing: ROS is not installed.
        ConnectionFailed: somebody does not answer.
    """
    missing = [name for name in scene.arms if name not in setup.arms]
    if missing:
        raise NotRegistered(
            f"the set-up has no {' and no '.join(missing)}, which the scene {scene.name!r} uses; "
            "add it under arms:"
        )
    setup = setup.used_by(scene.arms)
    registration = registered(setup, scene)
    cameras = open_cameras(setup, registration, scene)
    try:
        transport = connect(setup, "defras_check")
        try:
            arms = {name: CrtkArm(arm, transport) for name, arm in setup.arms.items()}
            listening()
            # While connections are being made, topics come late and one after the other.
            sleep(_CONNECT_S)
            watches = {name: Watch(arm.name, transport) for name, arm in setup.arms.items()}
            looks = []
            for _ in range(round(LISTEN_S / _LOOK_EVERY_S)):
                sleep(_LOOK_EVERY_S)
                looks.append((cameras.latest(), cameras.now_s()))
            yield CheckBench(
                setup,
                scene,
                registration,
                transport,
                {name: arms[name] for name in setup.arms},
                {name: watches[name] for name in setup.arms},
                cameras,
                looks,
                out,
            )
        finally:
            transport.close()
    finally:
        cameras.close()


def run_checks(bench: CheckBench, tell: Callable[[Finding], None]) -> list[Finding]:
    """Findings of all checks that move nothing; each is told as it comes."""
    findings = []
    for check in CHECKS:
        for finding in check.run(bench):
            tell(finding)
            findings.append(finding)
    return findings


def run_motion(bench: CheckBench, tell: Callable[[Finding], None]) -> list[Finding]:
    """Move every arm 2 mm along each axis; only after the operator's approval.

    Raises:
        ConnectionFailed: the stream cannot connect.
    """
    try:
        findings = _motion(bench)
    except ServoLost as lost:
        todo = "The arms hold where they are. Is this computer busy, or was a process ended?"
        findings = [wrong("stream", "computer", str(lost), todo)]
    for finding in findings:
        tell(finding)
    return findings


def _motion(bench: CheckBench) -> list[Finding]:
    """
    Raises:
        ConnectionFailed: the stream cannot connect.
        ServoLost: the process that streams does not answer.
    """
    setup, camera = bench.setup, bench.setup.cameras.depth
    servo = ServoProcess(setup)
    cloud: WholeCloud | None = None
    if camera is not None and camera.cloud is not None and isinstance(bench.transport, Ros1):
        cloud = WholeCloud(camera.cloud, bench.registration.cameras["depth"].pose)
    try:
        _wait_until_heard(servo)
        frames = {
            name: ArmFrames.of(arm, bench.registration.arms[name].pose)
            for name, arm in setup.arms.items()
        }
        check = MotionCheck(
            servo,
            {name: frames[name] for name in setup.arms},
            {name: arm.name for name, arm in setup.arms.items()},
            None if cloud is None else SeenTool(bench.scene, cloud.points_m),
            pause=partial(_pause, servo),
        )
        findings = check.run()
        findings.append(_regularity(servo.report()))
    finally:
        try:
            servo.close()
        finally:
            if cloud is not None:
                cloud.close()
    return findings


def _wait_until_heard(servo: ServoProcess) -> None:
    """Topics connect one after the other; what is missing in the end, the motion check says."""
    until_s = monotonic() + _HEARD_S
    while any(arm.stopped for arm in servo.snapshot().arms.values()) and monotonic() < until_s:
        sleep(_LOOK_EVERY_S)


def _pause(servo: ServoProcess, time_s: float) -> None:
    """Let ``time_s`` of the robot's time pass.

    Raises:
        Stopped: the robot is simulated, and its clock stands still.
    """
    if not servo.simulated_clock:
        sleep(time_s)
        return
    until_s, latest_s = servo.clock_s() + time_s, monotonic() + _CLOCK_STANDS_S
    while servo.clock_s() < until_s - 1e-6:
        if monotonic() > latest_s:
            raise Stopped(f"the simulation's clock stands still for {_CLOCK_STANDS_S:g} s")
        sleep(0.002)


def _regularity(report: StreamReport) -> Finding:
    period = report.period
    if report.broke:
        return wrong("stream", "computer", report.broke, "This is a fault of defras: report it.")
    if period.p99_s is None:
        return wrong("stream", "computer", "no set-point was sent", "See the findings of motion.")
    longest_s = period.longest_s or 0.0
    what = (
        f"99 of 100 set-points came within {period.p99_s * 1e3:.1f} ms of the one before, the last "
        f"within {longest_s * 1e3:.1f} ms (nominal {period.nominal_s * 1e3:g} ms"
        f"{', real-time scheduling' if report.realtime else ''})"
    )
    if period.p99_s <= (1.0 + _P99_SHARE) * period.nominal_s:
        return ok("stream", "computer", what)
    todo = (
        "Free this computer, or let the stream run before other programs "
        "(stream.realtime_priority; limits.conf: rtprio)."
    )
    return warning("stream", "computer", what, todo)
