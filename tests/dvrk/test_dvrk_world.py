"""The robot as a world: frames, time, grips, and what is told of what went wrong."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from defras_bt.dvrk.camera_source import CameraReadings, NoCameras
from defras_bt.dvrk.streaming.drive import ArmSnapshot
from defras_bt.dvrk.streaming.periods import Durations
from defras_bt.dvrk.streaming.servo_loop import Snapshot, StreamReport, Tick
from defras_bt.dvrk.streaming.servo_process import ServoLost
from defras_bt.dvrk.transport.transport import ConnectionFailed
from defras_bt.dvrk.world import DvrkWorld
from defras_bt.sensing.freshness import ages_s, stale
from defras_sim.geometry import Pose
from defras_sim.scene import Attachments, Roi, Scene
from defras_sim.worlds.protocol import HOLD, ArmCommand, Command, PointCloud, StreamsSetpoints
from tests.dvrk.toy_robot import BEGIN_S, ToyArm, toy_setup

SCENE = Scene(
    name="s", attachments=Attachments(map=("#" * 12,) * 12), roi=Roi(center_x_m=0, center_y_m=0)
).model_copy(update={"tick_s": 0.005})
BASE = Pose(np.array([0.05, 0.1, 0.2]), Rotation.from_rotvec([0.2, -0.4, 1.0]).as_matrix())
BASES = {"psm1": BASE, "psm2": Pose(np.array([0.0, -0.09, 0.2]))}
JAW_M = 0.0286


def snapshot_of(arm: ToyArm, stamp_s: float) -> ArmSnapshot:
    said = arm.messages(stamp_s)
    return ArmSnapshot(
        said["measured_cp"],
        said["setpoint_cp"],
        said["measured_js"],
        said["setpoint_js"],
        said["jaw/measured_js"],
        said["jaw/setpoint_js"],
        said["body/measured_cf"],
        said["operating_state"],
        None,
        "",
    )


class ToyServo:
    """Answers from toy arms; its clock goes on by a tick with each snapshot."""

    def __init__(self) -> None:
        self.arms = {"psm1": ToyArm("PSM1"), "psm2": ToyArm("PSM2")}
        self.now_s = BEGIN_S
        self.late_s = 0.002
        self.stopped: Mapping[str, str] = {}
        self.goal: Pose | None = None
        self.ticks: list[Tick] = []
        self.lost = ""
        self.silent = False
        self.hangs = False
        self.closed = False

    def command(self, tick: Tick) -> None:
        if self.lost:
            raise ServoLost(self.lost)
        self.ticks.append(tick)

    def snapshot(self) -> Snapshot:
        if self.lost:
            raise ServoLost(self.lost)
        self.now_s += SCENE.tick_s
        arms = {
            name: replace(
                snapshot_of(arm, self.now_s - self.late_s),
                stopped=self.stopped.get(name, ""),
                goal=self.goal,
            )
            for name, arm in self.arms.items()
        }
        if self.silent:
            arms = {name: replace(arm, jaw=None) for name, arm in arms.items()}
        return Snapshot(self.now_s, arms)

    def clock_s(self) -> float:
        return self.now_s

    def report(self) -> StreamReport:
        if self.lost:
            raise ServoLost(self.lost)
        return StreamReport(Durations().report(0.01), {"psm1": (0.01, 0.02)}, None)

    def close(self) -> None:
        self.closed = True
        if self.hangs:
            raise ServoLost("the process that drives the arms is silent for 5 s")


class ToyCameras:
    """Shows what the test wants, on the arms' clock."""

    def __init__(self, servo: ToyServo) -> None:
        self._servo = servo
        self.readings = CameraReadings()
        self.act: Callable[[], None] | None = None
        self.ahead_s = 0.0
        self.closed = False

    def latest(self) -> CameraReadings:
        return self.readings

    def now_s(self) -> float:
        return self._servo.now_s + self.ahead_s

    def when_unusable(self, act: Callable[[], None]) -> None:
        self.act = act

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def servo() -> ToyServo:
    return ToyServo()


@pytest.fixture
def cameras(servo: ToyServo) -> ToyCameras:
    return ToyCameras(servo)


@pytest.fixture
def world(servo: ToyServo, cameras: ToyCameras) -> DvrkWorld:
    return DvrkWorld(toy_setup(), SCENE, BASES, servo, cameras)


def test_poses_come_through_registration_and_tip(world: DvrkWorld, servo: ToyServo) -> None:
    seen = world.observe().arms["psm1"]
    reported = servo.arms["psm1"].setpoint
    # By hand: along the jaw from the reported point, then turned and shifted.
    tip_m = reported.position_m + JAW_M * reported.rotation[:, 2]
    np.testing.assert_allclose(
        seen.tissue_from_tip.position_m, BASE.rotation @ tip_m + BASE.position_m
    )
    np.testing.assert_allclose(seen.tissue_from_tip.rotation, BASE.rotation @ reported.rotation)
    assert seen.goal_tissue_from_tip is None


def test_the_goal_is_the_tips_own(world: DvrkWorld, servo: ToyServo) -> None:
    servo.goal = Pose(np.array([0.01, 0.02, -0.1]))
    world.step()
    goal = world.observe().arms["psm1"].goal_tissue_from_tip
    assert goal is not None
    np.testing.assert_allclose(goal.position_m, BASE.apply(np.array([0.01, 0.02, -0.1])))


def test_commands_are_turned_into_the_arms_frame(world: DvrkWorld, servo: ToyServo) -> None:
    velocity, turning = np.array([0.01, 0.0, -0.02]), np.array([0.0, 0.3, 0.0])
    world.command(Command({"psm1": ArmCommand(velocity, turning, jaw_rad=0.4)}))
    (tick,) = servo.ticks
    motion = tick.motions["psm1"]
    np.testing.assert_allclose(BASE.rotation @ motion.velocity.linear_m_s, velocity, atol=1e-12)
    np.testing.assert_allclose(BASE.rotation @ motion.velocity.angular_rad_s, turning, atol=1e-12)
    assert motion.jaw_rad == 0.4
    assert "psm2" not in tick.motions
    assert tick.stamps_s["psm1"] == pytest.approx(servo.now_s - 0.002)


@pytest.mark.parametrize(("wanted_rad", "sent_rad"), [(0.0, -0.2), (0.3, 0.3), (None, None)])
def test_a_jaw_grips_as_far_as_the_set_up_says(
    servo: ToyServo, wanted_rad: float | None, sent_rad: float | None
) -> None:
    arms = {n: a.model_copy(update={"closed_rad": -0.2}) for n, a in toy_setup().arms.items()}
    world = DvrkWorld(toy_setup(arms=arms), SCENE, BASES, servo, NoCameras())
    world.command(Command({"psm1": ArmCommand(jaw_rad=wanted_rad)}))
    assert servo.ticks[-1].motions["psm1"].jaw_rad == sent_rad


def test_a_command_that_nobody_can_carry_out(world: DvrkWorld) -> None:
    with pytest.raises(ValueError, match="no arm 'psm3'"):
        world.command(Command({"psm3": ArmCommand()}))


def test_a_picture_that_cannot_be_used_stops_what_was_decided_before(
    world: DvrkWorld, servo: ToyServo, cameras: ToyCameras
) -> None:
    moves = Command({"psm1": ArmCommand(np.array([0.01, 0.0, 0.0]))})
    world.command(moves)
    assert servo.ticks[-1].moves
    assert cameras.act is not None
    cameras.act()
    assert not servo.ticks[-1].moves
    # Decided without knowing of it.
    world.command(moves)
    assert not servo.ticks[-1].moves
    # Who has seen it decides.
    world.step()
    world.command(moves)
    assert servo.ticks[-1].moves


def test_world_time_is_the_robots_and_goes_on(world: DvrkWorld, servo: ToyServo) -> None:
    first = world.observe()
    world.step()
    second = world.observe()
    assert second.time_s - first.time_s == pytest.approx(SCENE.tick_s, abs=0.05)
    assert 0.0 <= second.time_s - second.arms["psm1"].stamp_s < 0.2
    assert world.time_s >= second.time_s


def test_a_jaw_that_stays_open_holds_something(world: DvrkWorld, servo: ToyServo) -> None:
    arm = servo.arms["psm1"]
    arm.jaw_setpoint_rad, arm.jaw_stop_rad = 0.0, 0.15
    for _ in range(3):
        world.step()
    assert world.observe().arms["psm1"].grasped is True
    assert world.observe().arms["psm2"].grasped is False


def test_currents_are_not_taken_for_a_force_sensor(world: DvrkWorld) -> None:
    assert world.observe().arms["psm1"].force_n is None


def test_with_a_sensor_the_force_on_the_tissue_is_told(
    servo: ToyServo, cameras: ToyCameras
) -> None:
    arm = SCENE.arms["psm1"].model_copy(update={"force_noise_sd_n": 0.01})
    scene = SCENE.model_copy(update={"arms": {**SCENE.arms, "psm1": arm}})
    world = DvrkWorld(toy_setup(), scene, BASES, servo, cameras)
    seen = world.observe().arms["psm1"]
    felt_along_jaw = 0.5
    assert seen.force_n is not None
    np.testing.assert_allclose(seen.force_n, -felt_along_jaw * seen.tissue_from_tip.rotation[:, 2])


class TestWhatGoesWrong:
    """Nothing is decided here; everything is told."""

    def test_a_stopped_arm(self, world: DvrkWorld, servo: ToyServo) -> None:
        servo.stopped = {"psm2": "PSM2: is PAUSED; only an arm that is ENABLED moves"}
        world.step()
        assert world.observe().stopped == servo.stopped

    def test_a_lost_process(self, world: DvrkWorld, servo: ToyServo) -> None:
        servo.lost = "the process that drives the arms has ended (exit code -9)"
        world.step()
        seen = world.observe()
        assert seen.arms == {}
        assert seen.stopped == dict.fromkeys(("psm1", "psm2"), servo.lost)
        world.command(HOLD)  # the order to stop is no error where nothing moves
        assert world.stream_values() is None

    def test_cameras_say_what_is_wrong(self, world: DvrkWorld, cameras: ToyCameras) -> None:
        faults = {"cloud": "the cloud is in millimetres", "endoscope": "its frame is wrong"}
        cameras.readings = CameraReadings(faults=faults)
        world.step()
        assert world.observe().stopped == {
            "cloud": "the cloud is in millimetres",
            "roi_visibility": "its frame is wrong",
        }

    def test_an_arm_that_says_nothing(
        self, servo: ToyServo, cameras: ToyCameras, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        servo.silent = True
        monkeypatch.setattr("defras_bt.dvrk.world._BEGIN_S", 0.1)
        with pytest.raises(ConnectionFailed, match="PSM1 and PSM2 did not say everything"):
            DvrkWorld(toy_setup(), SCENE, BASES, servo, cameras)


@pytest.mark.parametrize(("ahead_s", "acts"), [(0.012, True), (0.045, False)])
def test_clocks_a_little_ahead_are_no_future(
    ahead_s: float, acts: bool, servo: ToyServo, cameras: ToyCameras
) -> None:
    servo.late_s = -ahead_s
    world = DvrkWorld(toy_setup(), SCENE, BASES, servo, cameras)
    stamp_s = servo.now_s + SCENE.tick_s + ahead_s
    cloud = PointCloud(stamp_s, np.zeros((30, 3)))
    cameras.readings = CameraReadings(
        cloud=cloud, roi_visibility=0.3, roi_visibility_stamp_s=stamp_s
    )
    world.step()
    seen = world.observe()
    assert (stale(seen, SCENE) == {}) is acts
    assert not acts or ages_s(seen, SCENE)["psm1"] == 0.0


class TestCameras:
    """Their stamps become world time."""

    CLOUD = PointCloud(0.0, np.zeros((30, 3)))

    def test_on_the_arms_clock(
        self, world: DvrkWorld, servo: ToyServo, cameras: ToyCameras
    ) -> None:
        cloud = replace(self.CLOUD, stamp_s=servo.now_s - 0.1)
        cameras.readings = CameraReadings(
            cloud=cloud, roi_visibility=0.3, roi_visibility_stamp_s=servo.now_s - 0.2
        )
        world.step()
        seen = world.observe()
        assert seen.cloud is not None
        assert seen.roi_visibility_stamp_s is not None
        assert seen.arms["psm1"].stamp_s - seen.cloud.stamp_s == pytest.approx(0.103)
        assert seen.cloud.stamp_s - seen.roi_visibility_stamp_s == pytest.approx(0.1)

    def test_on_a_clock_of_their_own(self, servo: ToyServo, cameras: ToyCameras) -> None:
        cameras.ahead_s = 1000.0
        world = DvrkWorld(toy_setup(), SCENE, BASES, servo, cameras)
        cameras.readings = CameraReadings(cloud=replace(self.CLOUD, stamp_s=cameras.now_s() - 0.1))
        world.step()
        seen = world.observe()
        assert seen.cloud is not None
        assert seen.arms["psm1"].stamp_s - seen.cloud.stamp_s == pytest.approx(0.103)

    def test_of_before_the_world_began(
        self, world: DvrkWorld, servo: ToyServo, cameras: ToyCameras
    ) -> None:
        old_s = servo.now_s - 30.0
        cameras.readings = CameraReadings(
            cloud=replace(self.CLOUD, stamp_s=old_s),
            roi_visibility=0.9,
            roi_visibility_stamp_s=old_s,
        )
        world.step()
        assert world.observe().cloud is None
        assert world.observe().roi_visibility is None


def test_a_process_that_hangs_at_the_end_keeps_no_camera_open(
    world: DvrkWorld, servo: ToyServo, cameras: ToyCameras
) -> None:
    servo.hangs = True
    world.close()
    assert servo.closed
    assert cameras.closed


def test_closing_stops_and_closes_everything(
    world: DvrkWorld, servo: ToyServo, cameras: ToyCameras
) -> None:
    world.close()
    assert servo.ticks[-1].motions == {}
    assert servo.closed
    assert cameras.closed
    assert isinstance(world, StreamsSetpoints)
    values = world.stream_values()
    assert values is not None
    assert values["latency"] == {"psm1": {"median_s": 0.01, "p99_s": 0.02}}
