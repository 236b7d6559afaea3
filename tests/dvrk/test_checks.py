"""Each check says what is wrong, and what to do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from defras_bt.dvrk.camera_settings import Cameras, DepthCamera, Endoscope
from defras_bt.dvrk.camera_source import CameraReadings, NoCameras
from defras_bt.dvrk.checking import run
from defras_bt.dvrk.checking.arm_state import CommandersCheck, RestCheck, StateCheck
from defras_bt.dvrk.checking.bench import Check, CheckBench
from defras_bt.dvrk.checking.cameras import CameraCheck
from defras_bt.dvrk.checking.computer import DiskCheck
from defras_bt.dvrk.checking.finding import Finding
from defras_bt.dvrk.checking.messages import (
    ClockCheck,
    FramesCheck,
    NamesCheck,
    RateCheck,
    UnitsCheck,
)
from defras_bt.dvrk.checking.registered import RegistrationCheck
from defras_bt.dvrk.checking.tip import TipCheck
from defras_bt.dvrk.checking.watch import Watch
from defras_bt.dvrk.checking.workspace import WorkspaceCheck
from defras_bt.dvrk.crtk.arm import CrtkArm
from defras_bt.dvrk.laboratory import NotRegistered
from defras_bt.dvrk.registering.registration import Placed, Registration
from defras_bt.dvrk.settings import Limits, Setup
from defras_bt.dvrk.streaming.servo_loop import Snapshot
from defras_bt.dvrk.streaming.servo_process import ServoLost
from defras_bt.dvrk.transport.messages import JointMessage, Message, PoseMessage
from defras_sim.arm.kinematics import tip_pose
from defras_sim.geometry import Pose
from defras_sim.resources import resource
from defras_sim.scene import Scene, load_scene
from defras_sim.worlds.protocol import PointCloud
from tests.dvrk.toy_robot import HOME, PERIOD_S, ToyTransport, toy_setup

NOW = datetime(2026, 3, 1, 9, 30, tzinfo=UTC)
CAMERAS = Cameras(
    depth=DepthCamera(frame="d", cloud="/cloud"),
    endoscope=Endoscope(frame="e", image="/image", info="/info"),
)
Spoil = Callable[[str, str, Message], Message | None]


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene(resource("sim/scenes/demo.yaml"))


def registration(scene: Scene, **placed: Placed) -> Registration:
    arms = {
        name: Placed.of(Pose(np.array(arm.rcm_m))).model_copy(
            update={"rms_m": 0.0005, "left_out_m": 0.001, "landmarks": 5}
        )
        for name, arm in scene.arms.items()
    }
    return Registration(measured=NOW, scene=scene.name, arms={**arms, **placed})


class Lab:
    """A sound laboratory of toys; a test spoils something before it looks."""

    def __init__(self, scene: Scene, out: Path) -> None:
        self.scene, self.out = scene, out
        self.transport = ToyTransport("PSM1", "PSM2")
        self.setup = toy_setup(cameras=CAMERAS)
        self.registration = registration(scene)
        self.late_s = 0.002
        rng = np.random.default_rng(0)
        points_m = np.column_stack([rng.uniform(-0.06, 0.06, (500, 2)), np.zeros(500)])
        self.readings = CameraReadings(
            cloud=PointCloud(0.0, points_m), roi_visibility=0.1, roi_visibility_stamp_s=0.0
        )
        self.camera_age_s = 0.1

    def bench(self, periods: int = 60, period_s: float = PERIOD_S) -> CheckBench:
        transport = self.transport
        arms = {name: CrtkArm(arm, transport) for name, arm in self.setup.arms.items()}
        watches = {name: Watch(arm.name, transport) for name, arm in self.setup.arms.items()}
        spoil = transport.spoil
        for _ in range(periods):
            transport.clock_s += period_s
            late_s = self.late_s
            transport.spoil = lambda arm, topic, said, late_s=late_s: spoil(
                arm, topic, replace(said, stamp_s=said.stamp_s - late_s)
            )
            transport.publish()
        return CheckBench(
            self.setup,
            self.scene,
            self.registration,
            transport,
            {str(name): arm for name, arm in arms.items()},
            {str(name): watch for name, watch in watches.items()},
            NoCameras(),
            [(self.readings, self.camera_age_s)],
            self.out,
        )

    def find(self, check: Check, **listening: float) -> list[Finding]:
        return check.run(self.bench(**listening))


@pytest.fixture
def lab(scene: Scene, tmp_path: Path) -> Lab:
    return Lab(scene, tmp_path)


ALL = (
    StateCheck(),
    CommandersCheck(),
    RestCheck(),
    NamesCheck(),
    FramesCheck(),
    UnitsCheck(),
    RateCheck(),
    ClockCheck(),
    TipCheck(),
    RegistrationCheck(),
    WorkspaceCheck(),
    CameraCheck(),
    DiskCheck(),
)


@pytest.mark.parametrize("check", ALL, ids=lambda check: type(check).__name__)
def test_a_sound_laboratory_passes(lab: Lab, check: Check) -> None:
    # A toy whose tip stands where a scene's arm is at home.
    for arm in lab.transport.arms.values():
        arm.follow_kinematics()
    found = lab.find(check)
    assert found
    assert {one.grade for one in found} == {"ok"}, found


def worst(found: list[Finding], about: str = "PSM1") -> Finding:
    (one,) = [one for one in found if one.about == about and one.grade != "ok"]
    assert one.grade == "wrong", one
    assert one.todo
    return one


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"state": "FAULT"}, "is FAULT"),
        ({"state": "DISABLED"}, "is DISABLED"),
        ({"is_homed": False}, "is not homed"),
        ({"is_busy": True}, "somebody else asked for"),
    ],
)
def test_states_in_which_an_arm_does_not_move(
    lab: Lab, change: dict[str, object], says: str
) -> None:
    for name, value in change.items():
        setattr(lab.transport.arms["PSM1"], name, value)
    assert says in worst(lab.find(StateCheck())).what


def test_an_arm_that_is_not_there(lab: Lab) -> None:
    lab.transport.spoil = lambda arm, topic, said: None if arm == "PSM1" else said
    assert "has not said yet what state" in worst(lab.find(StateCheck())).what
    assert "0 Hz" in worst(lab.find(RateCheck())).what


def test_another_program_that_commands(lab: Lab) -> None:
    lab.transport.others = ("/teleop",)
    found = lab.find(CommandersCheck())
    assert "/teleop" in worst(found).what
    lab.transport.others = None
    assert {one.grade for one in lab.find(CommandersCheck())} == {"skipped"}


def test_an_arm_that_moves_by_itself(lab: Lab) -> None:
    arm = lab.transport.arms["PSM1"]

    def creep(name: str, topic: str, said: Message) -> Message:
        if name == "PSM1" and topic == "setpoint_cp":
            arm.setpoint = arm.setpoint.moved(np.array([1e-4, 0.0, 0.0]))
        return said

    lab.transport.spoil = creep
    assert "moved by" in worst(lab.find(RestCheck())).what


def test_joints_of_other_names(lab: Lab) -> None:
    def renamed(arm: str, topic: str, said: Message) -> Message:
        if arm == "PSM1" and topic == "measured_js" and isinstance(said, JointMessage):
            return replace(said, names=("outer_yaw", *said.names[1:]))
        return said

    lab.transport.spoil = renamed
    found = worst(lab.find(NamesCheck()))
    assert "outer_yaw" in found.what
    assert "yaw, pitch, insertion" in found.todo


@pytest.mark.parametrize(
    ("topic", "angles_rad", "says"),
    [
        ("jaw/measured_js", [], "has 0 joints; a jaw has one angle"),
        ("jaw/measured_js", [0.1, -0.1], "has 2 joints; a jaw has one angle"),
        ("jaw/setpoint_js", [np.nan], "is nan, which is not an angle"),
    ],
)
def test_a_jaw_of_no_angle_or_two(lab: Lab, topic: str, angles_rad: list[float], says: str) -> None:
    def spoilt(arm: str, of: str, said: Message) -> Message:
        if arm == "PSM1" and of == topic and isinstance(said, JointMessage):
            return replace(said, position=np.array(angles_rad))
        return said

    lab.transport.spoil = spoilt
    bench = lab.bench()
    assert says in worst(NamesCheck().run(bench)).what
    assert {one.about for one in UnitsCheck().run(bench)} == {"PSM1", "PSM2"}


def test_another_frame(lab: Lab) -> None:
    lab.transport.spoil = lambda arm, topic, said: (
        replace(said, frame="ECM")
        if arm == "PSM1" and topic == "measured_cp" and isinstance(said, PoseMessage)
        else said
    )
    assert "in the frame 'ECM'" in worst(lab.find(FramesCheck())).what


@pytest.mark.parametrize(
    ("topic", "factor", "says"),
    [
        ("measured_cp", 1000.0, "m away from its frame's origin"),
        ("measured_js", 180.0 / np.pi, "which no PSM reaches"),
        ("jaw/measured_js", 180.0 / np.pi, "its jaw stands at"),
    ],
)
def test_other_units(lab: Lab, topic: str, factor: float, says: str) -> None:
    lab.transport.arms["PSM1"].jaw_setpoint_rad = 0.5

    def scaled(arm: str, of: str, said: Message) -> Message:
        if arm != "PSM1" or of != topic:
            return said
        if isinstance(said, PoseMessage):
            return replace(said, pose=Pose(said.pose.position_m * factor, said.pose.rotation))
        assert isinstance(said, JointMessage)
        return replace(said, position=said.position * factor)

    lab.transport.spoil = scaled
    assert says in worst(lab.find(UnitsCheck())).what


def test_a_slow_driver(lab: Lab) -> None:
    found = worst(lab.find(RateCheck(), period_s=0.025))
    assert "measured_cp comes at 40 Hz" in found.what
    assert "50 Hz needed" in found.todo


def test_a_driver_that_is_slow_but_fast_enough(lab: Lab) -> None:
    assert {one.grade for one in lab.find(RateCheck(), period_s=0.015)} == {"warning"}


@pytest.mark.parametrize(
    ("late_s", "says"), [(0.1, "100 ms behind"), (-0.04, "40 ms ahead of this computer's")]
)
def test_clocks_out_of_step(lab: Lab, late_s: float, says: str) -> None:
    lab.late_s = late_s
    found = [one for one in lab.find(ClockCheck()) if one.check == "clock"]
    assert says in worst(found).what


def test_a_clock_a_little_ahead_is_no_negative_latency(lab: Lab) -> None:
    lab.late_s = -0.012
    clock, latency = [one.what for one in lab.find(ClockCheck()) if one.about == "PSM1"]
    assert clock == "clocks agree within 12.0 ms"
    assert latency == "99 of 100 messages are here within 0.0 ms"


def test_messages_that_take_too_long_now_and_then(lab: Lab) -> None:
    bench = lab.bench()
    watch = bench.watches["psm1"]
    for _ in range(3):
        watch._times_s["measured_cp"].append((lab.transport.clock_s - 0.06, lab.transport.clock_s))
    found = [one for one in ClockCheck().run(bench) if one.check == "latency"]
    assert "99 of 100 messages" in worst(found).what


class TestTip:
    """Which point is called the tip."""

    def test_the_jaws_end_for_the_wrist(self, lab: Lab) -> None:
        arm = lab.transport.arms["PSM1"]
        arm.setpoint = tip_pose(HOME)
        found = worst(lab.find(TipCheck()))
        assert "poses are those of the jaw's end, not of the wrist" in found.what
        assert found.todo == "Set arms.*.reported: jaw."

    def test_another_tool(self, lab: Lab) -> None:
        # A large needle driver's jaw is 9.1 mm from pitch to yaw axis, a ProGrasp's 10.7.
        arm = lab.transport.arms["PSM1"]
        arm.setpoint = arm.setpoint.moved(np.array([0.0, 0.0, 0.0016]))
        found = worst(lab.find(TipCheck()))
        assert "1.6 mm away from where the joints put a ProGrasp's" in found.what

    def test_turned_axes(self, lab: Lab) -> None:
        arm = lab.transport.arms["PSM1"]
        turn = Rotation.from_euler("x", 90, degrees=True).as_matrix()
        arm.setpoint = Pose(arm.setpoint.position_m, arm.setpoint.rotation @ turn)
        assert "does not point along the jaw" in worst(lab.find(TipCheck())).what

    def test_nothing_to_compare(self, lab: Lab) -> None:
        lab.transport.spoil = lambda arm, topic, said: None if "local" in topic else said
        assert {one.grade for one in lab.find(TipCheck())} == {"skipped"}


class TestRegistration:
    """Residuals, and where the arms stand."""

    def placed(self, lab: Lab, **update: object) -> Placed:
        return lab.registration.arms["psm1"].model_copy(update=update)

    def test_large_residuals(self, lab: Lab, scene: Scene) -> None:
        lab.registration = registration(scene, psm1=self.placed(lab, rms_m=0.003))
        assert "3.0 mm off on average" in worst(lab.find(RegistrationCheck()), "psm1").what

    def test_one_bad_landmark(self, lab: Lab, scene: Scene) -> None:
        lab.registration = registration(scene, psm1=self.placed(lab, left_out_m=0.009))
        (found,) = [f for f in lab.find(RegistrationCheck()) if f.grade == "warning"]
        assert "One landmark is off" in found.todo

    def test_an_arm_that_stands_elsewhere(self, lab: Lab, scene: Scene) -> None:
        away = Pose(np.array(scene.arms["psm1"].rcm_m) + [0.05, 0.0, 0.0])
        sound = self.placed(lab)
        moved = sound.model_copy(update={"position_m": Placed.of(away).position_m})
        lab.registration = registration(scene, psm1=moved)
        found = worst(lab.find(RegistrationCheck()), "psm1")
        assert "50 mm away from the scene's" in found.what
        assert "arms.psm1.rcm_m: [0.0500" in found.todo


def test_an_arm_too_far_away_to_reach_anything(lab: Lab, scene: Scene) -> None:
    lab.registration = registration(
        scene, psm1=Placed.of(Pose(np.array(scene.arms["psm1"].rcm_m) + [0.0, 0.3, 0.2]))
    )
    assert "reaches none of its 15 grasp points" in worst(lab.find(WorkspaceCheck())).what


class TestCameras:
    """Clouds and pictures."""

    def test_old_ones(self, lab: Lab) -> None:
        lab.camera_age_s = 0.7
        found = lab.find(CameraCheck())
        assert "0.70 s old" in worst(found, "depth").what
        assert "0.70 s old" in worst(found, "endoscope").what

    def test_from_the_future(self, lab: Lab) -> None:
        lab.camera_age_s = -0.45
        found = lab.find(CameraCheck())
        assert "450 ms in the future" in worst(found, "depth").what
        assert "450 ms in the future" in worst(found, "endoscope").what
        lab.camera_age_s = -0.01
        assert "wrong" not in {one.grade for one in lab.find(CameraCheck())}

    def test_what_the_source_found(self, lab: Lab) -> None:
        lab.readings = replace(lab.readings, faults={"cloud": "the cloud is in millimetres"})
        assert worst(lab.find(CameraCheck()), "depth").what == "the cloud is in millimetres"

    def test_nothing_came(self, lab: Lab) -> None:
        lab.readings = CameraReadings()
        assert "no cloud" in worst(lab.find(CameraCheck()), "depth").what

    def test_a_camera_that_is_registered_wrongly(self, lab: Lab) -> None:
        cloud = lab.readings.cloud
        assert cloud is not None
        low = PointCloud(0.0, cloud.points_m - [0.0, 0.0, 0.012])
        lab.readings = replace(lab.readings, cloud=low)
        assert "12.0 mm below" in worst(lab.find(CameraCheck()), "depth").what

    def test_slow_ones(self, lab: Lab) -> None:
        bench = lab.bench()
        cloud = lab.readings.cloud
        assert cloud is not None
        looks = [
            (replace(lab.readings, cloud=replace(cloud, stamp_s=0.4 * (n // 8))), 0.05 * n + 0.1)
            for n in range(40)
        ]
        (found,) = [
            one for one in CameraCheck().run(replace(bench, looks=looks)) if one.about == "depth"
        ]
        assert found.grade == "warning"
        assert "comes at 2.5 Hz, 10 Hz are usual" in found.what

    def test_none_at_all(self, lab: Lab) -> None:
        lab.setup = toy_setup()
        found = lab.find(CameraCheck())
        assert [one.grade for one in found] == ["wrong", "wrong"]


def test_no_room_for_the_recording(lab: Lab) -> None:
    lab.setup = Setup.model_validate(
        {**lab.setup.model_dump(), "limits": Limits(disk_free_mb=1e9).model_dump()}
    )
    assert "MB are free" in worst(lab.find(DiskCheck()), "computer").what


class LostServo:
    """Hears nothing of its process any more, from the first question on."""

    def __init__(self, setup: Setup) -> None:
        pass

    def snapshot(self) -> Snapshot:
        raise ServoLost("the process that drives the arms has ended (exit code -9)")

    def close(self) -> None:
        raise ServoLost("the process that drives the arms is silent for 5 s")


def test_a_stream_that_is_lost_is_a_finding(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run, "ServoProcess", LostServo)
    told: list[Finding] = []
    assert run.run_motion(lab.bench(), told.append) == told
    assert "the process that drives the arms" in worst(told, "computer").what


def test_without_a_registration_nobody_listens(lab: Lab, tmp_path: Path) -> None:
    setup = lab.setup.model_copy(update={"registration": tmp_path / "none.yaml"})
    said: list[str] = []
    with (
        pytest.raises(NotRegistered, match="register arms and cameras first"),
        run.check_bench(setup, lab.scene, tmp_path, lambda: said.append("listening")),
    ):
        pass
    assert said == []
