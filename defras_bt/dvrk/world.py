"""DvrkWorld: two arms of a dVRK and the laboratory's cameras as the executive's world."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from threading import Event
from time import monotonic, sleep
from typing import Any

from defras_bt.dvrk.arm_reader import ArmReader, is_heard
from defras_bt.dvrk.camera_source import CameraReadings, CameraSource
from defras_bt.dvrk.settings import Setup
from defras_bt.dvrk.stream_values import stream_values
from defras_bt.dvrk.streaming.drive import ArmMotion
from defras_bt.dvrk.streaming.servo_loop import Servo, Snapshot, Tick
from defras_bt.dvrk.streaming.servo_process import ServoLost
from defras_bt.dvrk.transport.transport import ConnectionFailed
from defras_bt.dvrk.world_clock import WorldClock
from defras_sim.geometry import Pose
from defras_sim.scene import Scene
from defras_sim.surface import Surface
from defras_sim.worlds.protocol import HOLD, ArmObservation, Command, Observation

_BEGIN_S = 15.0
"""So long all arms have to be heard for the first time: many topics connect one after another."""
_ONE_CLOCK_S = 0.05
_READINGS = {"cloud": "cloud", "endoscope": "roi_visibility"}
"""Readings of the executive by the name under which a camera source tells its faults."""


class DvrkWorld:
    """The robot as it is. Nothing here decides: what is odd is told in words, and left out.

    A picture that cannot be used ends at once what was decided on those before it: a tick is as
    long as the time in which an arm has to stop. Whether to go on is decided in the next one.

    Poses are those of the registration. An arm's set-point is the one that it echoes; where
    commands lead ahead of it is its goal.
    """

    name = "dvrk"

    def __init__(
        self,
        setup: Setup,
        scene: Scene,
        tissue_from_base: Mapping[str, Pose],
        servo: Servo,
        cameras: CameraSource,
        *,
        simulated_clock: bool = False,
    ) -> None:
        """``servo`` and ``cameras`` are closed with the world.

        Raises:
            ConnectionFailed: an arm of the set-up does not say anything.
            KeyError: an arm is not registered.
        """
        self.tick_s = scene.tick_s
        self._ahead_s = setup.limits.clock_offset_s
        self._servo, self._cameras = servo, cameras
        self._names: dict[str, str] = {name: arm.name for name, arm in setup.arms.items()}
        self._readers: dict[str, ArmReader] = {
            name: ArmReader(
                arm,
                tissue_from_base[name],
                senses_force=scene.arms[name].force_noise_sd_n is not None,
            )
            for name, arm in setup.arms.items()
        }
        self._lost = ""
        self._unseen_fault = Event()
        """A picture became unusable after the latest observation."""
        self._stamps_s: dict[str, float] = {}
        self._report: Mapping[str, Any] | None = None
        snapshot = self._first_snapshot()
        # World time begins a little before the first look, so that no reading is of a time before.
        begin_s = snapshot.clock_s - 1.0
        self._clock = WorldClock(begin_s, self.tick_s, simulated=simulated_clock)
        self._camera_offset_s = _offset_s(snapshot.clock_s, cameras.now_s())
        cameras.when_unusable(self._stop_at_once)
        self._latest = self._seen(snapshot)

    @property
    def time_s(self) -> float:
        return self._clock.now_s()

    @property
    def begin_stamp_s(self) -> float:
        """The robot's time at which world time is 0."""
        return self._clock.begin_s

    def observe(self) -> Observation:
        return self._latest

    def command(self, command: Command) -> None:
        """Have the stream carry out the coming tick.

        Raises:
            ValueError: an arm is unknown or a number is not finite.
        """
        command.require_valid(self._names)
        motions = {
            name: ArmMotion(
                self._readers[name].frames.velocity(arm.linear_m_s, arm.angular_rad_s),
                self._readers[name].jaw_goal_rad(arm.jaw_rad),
            )
            for name, arm in command.arms.items()
        }
        self._drive(Tick(motions, self.tick_s, dict(self._stamps_s)))
        if self._unseen_fault.is_set():
            # It came while the command was made; asked afterwards, because it may come now.
            self._stop()

    def step(self) -> None:
        """Wait for the next tick, and look at everything."""
        self._clock.wait_for_tick(self._look)
        try:
            snapshot = self._servo.snapshot()
        except ServoLost as lost:
            self._lost = str(lost)
            self._latest = self._blind()
            return
        self._latest = self._seen(snapshot)

    def true_force_n(self) -> float | None:
        return None

    def true_surface(self) -> Surface | None:
        return None

    def stream_values(self) -> Mapping[str, Any] | None:
        """How the stream of set-points went, for ``run.json``; None where nobody can tell."""
        if self._report is not None:
            return self._report
        try:
            return stream_values(self._servo.report())
        except ServoLost:
            return None

    def close(self) -> None:
        """Stop both arms and listen no more; grips stay as they are."""
        self.command(HOLD)
        self._report = self.stream_values()
        # First, or a last picture would still stop arms that nobody drives any more.
        self._cameras.close()
        try:
            self._servo.close()
        except ServoLost as lost:
            # It was ended, and the arms hold; who asks for the stream's numbers gets none.
            self._lost = str(lost)

    def _stop_at_once(self) -> None:
        self._unseen_fault.set()
        self._stop()

    def _stop(self) -> None:
        self._drive(Tick({}, self.tick_s))

    def _drive(self, tick: Tick) -> None:
        try:
            self._servo.command(tick)
        except ServoLost as lost:
            # Without its process no arm is driven, which is what a hold asks for; the next
            # observation says that, and why.
            self._lost = str(lost)

    def _look(self) -> float:
        try:
            return self._servo.clock_s()
        except ServoLost as lost:
            self._lost = str(lost)
            return float("inf")

    def _first_snapshot(self) -> Snapshot:
        began_s = monotonic()
        while True:
            snapshot = self._servo.snapshot()
            silent = [self._names[name] for name, arm in snapshot.arms.items() if not is_heard(arm)]
            if not silent:
                return snapshot
            if monotonic() - began_s > _BEGIN_S:
                whys = "; ".join(arm.stopped for arm in snapshot.arms.values() if arm.stopped)
                raise ConnectionFailed(
                    f"{' and '.join(silent)} did not say everything within {_BEGIN_S:g} s that is "
                    "needed (measured_cp, setpoint_cp, jaw/measured_js, jaw/setpoint_js, "
                    f"operating_state): {whys}"
                )
            sleep(0.05)

    def _seen(self, snapshot: Snapshot) -> Observation:
        self._clock.looked(snapshot.clock_s)
        readings = self._cameras_latest()
        arms = {
            name: self._readers[name].read(seen, self._clock)
            for name, seen in snapshot.arms.items()
            if is_heard(seen)
        }
        stopped = {name: seen.stopped for name, seen in snapshot.arms.items() if seen.stopped}
        broke = self._lost or snapshot.broke
        if broke:
            stopped |= dict.fromkeys(self._names, broke)
        self._note_stamps(snapshot, readings)
        return self._observation(readings, arms, stopped)

    def _blind(self) -> Observation:
        """Nobody tells anything about the arms any more."""
        stopped = dict.fromkeys(self._names, self._lost)
        return self._observation(self._cameras_latest(), {}, stopped)

    def _observation(
        self,
        readings: CameraReadings,
        arms: Mapping[str, ArmObservation],
        stopped: Mapping[str, str],
    ) -> Observation:
        cloud, depth, picture = readings.cloud, readings.depth_image, readings.endoscope_image
        faults = {_READINGS.get(what, what): why for what, why in readings.faults.items()}
        visible_s, now_s = readings.roi_visibility_stamp_s, self._clock.now_s()

        def camera_s(stamp_s: float) -> float:
            return self._by_now_s(self._camera_s(stamp_s), now_s)

        return Observation(
            time_s=now_s,
            arms={
                name: replace(arm, stamp_s=self._by_now_s(arm.stamp_s, now_s))
                for name, arm in arms.items()
            },
            cloud=None if cloud is None else replace(cloud, stamp_s=camera_s(cloud.stamp_s)),
            depth_image=None if depth is None else replace(depth, stamp_s=camera_s(depth.stamp_s)),
            endoscope_image=None
            if picture is None
            else replace(picture, stamp_s=camera_s(picture.stamp_s)),
            roi_visibility=readings.roi_visibility,
            roi_visibility_stamp_s=None if visible_s is None else camera_s(visible_s),
            stopped={**stopped, **faults},
        )

    def _cameras_latest(self) -> CameraReadings:
        """The cameras' readings, less those of before the world began."""
        self._unseen_fault.clear()
        readings = self._cameras.latest()
        cloud, seen_s = readings.cloud, readings.roi_visibility_stamp_s
        if cloud is not None and self._camera_s(cloud.stamp_s) < 0.0:
            readings = replace(readings, cloud=None)
        if seen_s is not None and self._camera_s(seen_s) < 0.0:
            readings = replace(readings, roi_visibility=None, roi_visibility_stamp_s=None)
        depth, picture = readings.depth_image, readings.endoscope_image
        if depth is not None and self._camera_s(depth.stamp_s) < 0.0:
            readings = replace(readings, depth_image=None)
        if picture is not None and self._camera_s(picture.stamp_s) < 0.0:
            readings = replace(readings, endoscope_image=None)
        return readings

    def _by_now_s(self, world_s: float, now_s: float) -> float:
        """World time of a stamp, which a clock that is ahead by no more than the check allows puts
        at the present; one of a later future stays there, and is not acted on."""
        return min(world_s, now_s) if world_s - now_s <= self._ahead_s else world_s

    def _camera_s(self, stamp_s: float) -> float:
        """World time of a camera's stamp."""
        return self._clock.world_s(stamp_s + self._camera_offset_s)

    def _note_stamps(self, snapshot: Snapshot, readings: CameraReadings) -> None:
        """What the next command will be decided on, for the latency from sensor to command."""
        self._stamps_s = {
            name: seen.measured.stamp_s
            for name, seen in snapshot.arms.items()
            if seen.measured is not None
        }
        offset_s = self._camera_offset_s
        if readings.cloud is not None:
            self._stamps_s["cloud"] = readings.cloud.stamp_s + offset_s
        if readings.roi_visibility_stamp_s is not None:
            self._stamps_s["endoscope"] = readings.roi_visibility_stamp_s + offset_s


def _offset_s(clock_s: float, camera_clock_s: float) -> float:
    """Between the arms' clock and the cameras'; 0 where they are one and the same."""
    offset_s = clock_s - camera_clock_s
    return 0.0 if abs(offset_s) < _ONE_CLOCK_S else offset_s
