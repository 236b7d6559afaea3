"""2 mm to and fro find an arm that goes elsewhere; a check's file lets nothing else pass."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from defras_bt.cli.dvrk_laboratory import checked_laboratory, slowed
from defras_bt.cli.errors import UserError
from defras_bt.dvrk.arm_frames import ArmFrames
from defras_bt.dvrk.checking.finding import Finding, ok, wrong
from defras_bt.dvrk.checking.motion import MotionCheck, Stroke, judged_by_camera
from defras_bt.dvrk.checking.report import (
    CheckReport,
    NotChecked,
    fingerprint,
    read_check,
    require_checked,
    write_check,
)
from defras_bt.dvrk.crtk.arm import CrtkArm
from defras_bt.dvrk.registering.registration import Placed, Registration, write_registration
from defras_bt.dvrk.settings import Setup, load_setup
from defras_bt.dvrk.streaming.command_log import CommandLog
from defras_bt.dvrk.streaming.drive import ArmDrive
from defras_bt.dvrk.streaming.periods import Durations
from defras_bt.dvrk.streaming.servo_loop import Snapshot, StreamReport, Tick
from defras_bt.planning.scene_hash import scene_hash
from defras_sim.geometry import Floats, Pose
from defras_sim.resources import resource
from defras_sim.scene import Scene, load_scene
from tests.dvrk.toy_robot import PERIOD_S, ToyArm, ToyTransport, toy_setup

NOW = datetime(2026, 3, 1, 9, 30, tzinfo=UTC)
BASE = Pose(np.array([0.0, 0.09, 0.2]), Rotation.from_rotvec([0.0, 0.0, 0.7]).as_matrix())


class SteppedServo:
    """Drives a toy arm with the real streams, a period whenever time passes."""

    def __init__(self, spoil: Callable[[ToyArm], None] = lambda arm: None) -> None:
        setup = toy_setup()
        self._transport = ToyTransport("PSM1")
        client = CrtkArm(setup.arms["psm1"], self._transport)
        self._drive = ArmDrive(client, setup.stream, setup.limits, CommandLog())
        spoil(self._transport.arms["PSM1"])
        self.arm = self._transport.arms["PSM1"]
        self.pause(0.05)

    def command(self, tick: Tick) -> None:
        self._drive.command(tick.motions.get("psm1"), tick.tick_s, self._transport.clock_s)

    def pause(self, time_s: float) -> None:
        for _ in range(round(time_s / PERIOD_S)):
            self._transport.clock_s += PERIOD_S
            self._transport.publish()
            self._drive.period(self._transport.clock_s, PERIOD_S, "")

    def snapshot(self) -> Snapshot:
        return Snapshot(self._transport.clock_s, {"psm1": self._drive.snapshot()})

    def clock_s(self) -> float:
        return self._transport.clock_s

    def report(self) -> StreamReport:
        return StreamReport(Durations().report(PERIOD_S), {}, None)

    def close(self) -> None:
        pass


def moved(spoil: Callable[[ToyArm], None] = lambda arm: None) -> tuple[SteppedServo, list[Finding]]:
    servo = SteppedServo(spoil)
    frames = {"psm1": ArmFrames.of(toy_setup().arms["psm1"], BASE)}
    return servo, MotionCheck(servo, frames, {"psm1": "PSM1"}, pause=servo.pause).run()


def test_a_sound_arm_goes_there_and_back() -> None:
    servo = SteppedServo()
    start_m = servo.arm.setpoint.position_m
    servo, found = moved()
    assert [one.check for one in found] == ["motion", "motion", "motion", "jaw"]
    assert {one.grade for one in found} == {"ok"}
    assert "moved +2.00 mm along x" in found[0].what
    np.testing.assert_allclose(servo.arm.setpoint.position_m, start_m, atol=1e-5)
    assert servo.arm.jaw_setpoint_rad == pytest.approx(0.0, abs=1e-9)


def measuring(change: Callable[[Floats], Floats]) -> Callable[[ToyArm], None]:
    """The arm measures other motions than its set-point makes."""

    def spoil(arm: ToyArm) -> None:
        start = arm.setpoint
        messages = arm.messages

        def spoilt(stamp_s: float):
            gone_m = arm.setpoint.position_m - start.position_m
            arm.measured = start.moved(change(gone_m))
            return messages(stamp_s)

        arm.messages = spoilt  # type: ignore[method-assign]

    return spoil


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (measuring(lambda gone_m: -gone_m), "it went the other way"),
        (measuring(lambda gone_m: Rotation.from_euler("z", 0.5).apply(gone_m)), "mm aside"),
        (measuring(lambda gone_m: 0.0 * gone_m), "it hardly moved"),
        (measuring(lambda gone_m: 1.5 * gone_m), "too far or too short"),
    ],
)
def test_an_arm_that_goes_elsewhere(spoil: Callable[[ToyArm], None], says: str) -> None:
    _, found = moved(spoil)
    assert found[-1].grade == "wrong"
    assert says in found[-1].what


def test_an_arm_that_stops_says_why() -> None:
    def paused(arm: ToyArm) -> None:
        arm.state = "PAUSED"

    _, (found,) = moved(paused)
    assert "PAUSED" in found.what


@pytest.mark.parametrize("rests_rad", [-0.30, -0.05])
def test_a_jaw_that_rests_beyond_closed(rests_rad: float) -> None:
    def spoil(arm: ToyArm) -> None:
        arm.jaw_setpoint_rad = rests_rad

    servo, found = moved(spoil)
    assert found[-1].what == "opened by 0.10 rad when told 0.1"
    assert servo.arm.jaw_setpoint_rad == pytest.approx(rests_rad)


def test_a_jaw_of_the_wrong_sign() -> None:
    def spoil(arm: ToyArm) -> None:
        messages = arm.messages

        def spoilt(stamp_s: float):
            said = messages(stamp_s)
            jaw = said["jaw/measured_js"]
            said["jaw/measured_js"] = replace(jaw, position=-jaw.position)
            return said

        arm.messages = spoilt  # type: ignore[method-assign]

    _, found = moved(spoil)
    assert "turned by -0.10 rad when told +0.1" in found[-1].what


@pytest.mark.parametrize(
    ("seen_m", "grade"),
    [
        ([0.0018, 0.0004, 0.0], "ok"),
        ([0.0, 0.002, 0.0], "wrong"),
        ([-0.002, 0.0, 0.0], "wrong"),
        (None, "skipped"),
    ],
)
def test_what_a_camera_says_of_a_stroke(seen_m: list[float] | None, grade: str) -> None:
    commanded_m = np.array([0.002, 0.0, 0.0])
    stroke = Stroke(commanded_m, commanded_m, None if seen_m is None else np.array(seen_m))
    assert judged_by_camera("PSM1", "x", stroke).grade == grade


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene(resource("sim/scenes/demo.yaml"))


class TestRefusal:
    """A robot is not run without a fresh check of the very same things."""

    @pytest.fixture
    def setup(self, tmp_path: Path, scene: Scene) -> Setup:
        file = tmp_path / "lab.yaml"
        file.write_text(
            "name: bench\narms:\n  psm1: {name: PSM1, frame: PSM1_base}\n"
            "  psm2: {name: PSM2, frame: PSM2_base}\n"
        )
        registration = Registration(measured=NOW, scene=scene.name)
        write_registration(
            registration.with_arm("psm1", Placed.of(BASE), NOW), tmp_path / "registration.yaml"
        )
        return load_setup(file)

    def write(self, setup: Setup, scene: Scene, /, **changes: object) -> CheckReport:
        report = CheckReport(
            checked=NOW,
            setup=setup.fingerprint,
            registration=fingerprint(setup.registration),
            scene=scene_hash(scene),
            scene_name=scene.name,
            moved=True,
            findings=(ok("state", "PSM1", "is ENABLED"),),
        ).model_copy(update=changes)
        write_check(report, setup.checked)
        return report

    def test_a_fresh_check_that_passed(self, setup: Setup, scene: Scene) -> None:
        report = self.write(setup, scene)
        assert require_checked(setup, scene, NOW + timedelta(hours=1)) == report
        assert read_check(setup.checked).passed

    def test_a_run_goes_no_faster_than_the_robot(self, setup: Setup, scene: Scene) -> None:
        self.write(setup, scene, checked=datetime.now(UTC))
        laboratory = checked_laboratory(setup.checked.with_name("lab.yaml"), scene)
        on_robot = slowed(scene, laboratory)
        assert scene.motion.reach_speed_m_s == 0.05
        assert on_robot.motion.reach_speed_m_s == 0.03
        assert on_robot.motion.tissue_speed_m_s == scene.motion.tissue_speed_m_s

    @pytest.mark.parametrize(
        ("changes", "after_h", "says"),
        [
            ({"moved": False}, 1, "moved nothing"),
            ({"findings": (wrong("state", "PSM1", "is FAULT", "clear it"),)}, 1, "PSM1: is FAULT"),
            ({}, 13, "13.0 h old, 12 h are allowed"),
            ({}, -1, "-1.0 h old"),
            ({"setup": "other"}, 1, "the set-up was changed"),
            ({"registration": "other"}, 1, "were registered since"),
            ({"scene": "other"}, 1, "the check was for the scene 'demo' as it was then"),
        ],
    )
    def test_every_other(
        self, setup: Setup, scene: Scene, changes: dict[str, object], after_h: float, says: str
    ) -> None:
        self.write(setup, scene, **changes)
        with pytest.raises(NotChecked, match=says):
            require_checked(setup, scene, NOW + timedelta(hours=after_h))

    def test_none_at_all(self, setup: Setup, scene: Scene) -> None:
        with pytest.raises(NotChecked, match="run defras dvrk check first"):
            require_checked(setup, scene, NOW)
        with pytest.raises(UserError, match=r"--world dvrk: .*dvrk_check\.json does not exist"):
            checked_laboratory(setup.checked.with_name("lab.yaml"), scene)

    def test_something_else_than_a_check(self, setup: Setup, scene: Scene) -> None:
        setup.checked.write_text('["passed"]')
        with pytest.raises(NotChecked, match="is no check's file"):
            require_checked(setup, scene, NOW)

    @pytest.mark.parametrize(
        ("content", "says"),
        [
            ({"checked": "2026-03-01T09:30:00"}, "checked: Input should have timezone info"),
            ({"moved": None}, "moved: Input should be a valid boolean"),
        ],
    )
    def test_a_check_that_was_changed(
        self, setup: Setup, scene: Scene, content: dict[str, object], says: str
    ) -> None:
        self.write(setup, scene)
        written = json.loads(setup.checked.read_text())
        setup.checked.write_text(json.dumps(written | content))
        with pytest.raises(NotChecked) as refused:
            require_checked(setup, scene, NOW)
        assert f"({says}): run defras dvrk check" in str(refused.value)

    def test_no_set_up_at_all(self, scene: Scene) -> None:
        with pytest.raises(UserError, match="--setup"):
            checked_laboratory(None, scene)
