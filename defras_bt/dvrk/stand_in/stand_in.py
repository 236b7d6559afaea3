"""The stand-in put together: two arms at 100 Hz, and the patient's process beside them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from threading import Event, RLock
from time import monotonic
from typing import Literal

import numpy as np

from defras_bt.dvrk.ros_packages import ros_module
from defras_bt.dvrk.stand_in.arm_topics import ArmTopics
from defras_bt.dvrk.stand_in.drive import joints_near
from defras_bt.dvrk.stand_in.imperfections import Imperfections
from defras_bt.dvrk.stand_in.operating import Operating
from defras_bt.dvrk.stand_in.pacing import Pace, RealPace, SimulatedPace
from defras_bt.dvrk.stand_in.patient import TipTarget
from defras_bt.dvrk.stand_in.patient_process import (
    Motion,
    PatientOrder,
    PatientProcess,
    WorldName,
)
from defras_bt.dvrk.stand_in.psm import Psm
from defras_bt.dvrk.stand_in.ros_node import join
from defras_sim.arm.kinematics import tip_pose
from defras_sim.effects.layers import Layers
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import ArmName, Scene
from defras_sim.worlds.force_sensor import NO_FORCE
from defras_sim.worlds.protocol import JAW_CLOSED_RAD

NODE = "defras_arms"
PERIOD_S = 0.01
"""A dVRK publishes at 100 Hz unless told otherwise."""

WORLD_TICK_S = 0.02
LATE_AFTER_S = 0.25
"""A patient this far behind the arms is said to fall behind."""

_WAIT_S = 30.0

Clock = Literal["real", "simulated"]


@dataclass(frozen=True)
class StandInOrder:
    """What to stand in for. ``actual``: the scene as it really is."""

    actual: Scene
    world: WorldName = "model"
    imperfections: Imperfections = field(default_factory=Imperfections)
    seed: int = 0
    master_uri: str = "http://localhost:11311"
    clock: Clock = "real"
    speed: float = 1.0
    """Of a simulated clock, at most, as a multiple of the wall's."""
    operating: Operating = field(default_factory=Operating)


class StandIn:
    """Arms and patient on a ROS master. A process can hold one."""

    def __init__(self, order: StandInOrder, say: Callable[[str], None]) -> None:
        """``say`` takes sentences for whoever watches.

        Raises:
            NoMaster: no ROS master answers.
            RosMissing: ROS 1 is not installed.
            PatientLost: the patient's world does not come up.
        """
        self._say = say
        self._lock = RLock()
        self._stop = Event()
        self._rng = np.random.default_rng([order.seed, 1])
        self._noise_n = order.imperfections.force_noise_sd_n
        self.rospy = join(order.master_uri, NODE, simulated_clock=order.clock == "simulated")
        self._arms: dict[str, Psm] = {name: self._arm(order, name) for name in order.actual.arms}
        publish_clock = self._clock_publisher() if order.clock == "simulated" else None
        self._patient = PatientProcess(
            PatientOrder(
                actual=order.actual,
                world=order.world,
                tick_s=WORLD_TICK_S,
                imperfections=order.imperfections,
                seed=order.seed,
                master_uri=order.master_uri,
                simulated_clock=order.clock == "simulated",
                tips={name: arm.drive.tip(NO_FORCE) for name, arm in self._arms.items()},
            )
        )
        if publish_clock is None:
            self._pace: Pace = RealPace(PERIOD_S)
        else:
            self._pace = SimulatedPace(PERIOD_S, order.speed, publish_clock)
        self._patient.begin(self._pace.start_s)
        self._lockstep = order.clock == "simulated"
        self._topics = {
            name: ArmTopics(
                self.rospy, arm, name.upper(), self._lock, self._stamp_s, self._force(name)
            )
            for name, arm in self._arms.items()
        }
        self._ticks = 0
        self._late_since_s: float | None = None

    def run(self) -> None:
        """Stand in until :meth:`stop`.

        Raises:
            PatientLost: the patient's world cannot go on.
        """
        try:
            while not self._stop.is_set() and not self.rospy.is_shutdown():
                passed_s = self._pace.next_period_s()
                with self._lock:
                    for arm in self._arms.values():
                        arm.advance(passed_s)
                self._keep_up()
                for topics in self._topics.values():
                    topics.publish()
        finally:
            self._patient.close()
            self.rospy.signal_shutdown("the stand-in ends")

    def stop(self) -> None:
        """End :meth:`run`; may be called from anywhere."""
        self._stop.set()

    def _keep_up(self) -> None:
        """Tell the patient of every tick that has passed, and hear what it answers."""
        now_s = self._pace.now_s()
        while (self._ticks + 1) * WORLD_TICK_S <= now_s + 1e-9:
            self._ticks += 1
            self._patient.tell(Motion(self._ticks, self._targets()))
        self._patient.hear()
        if self._lockstep:
            waiting_since_s = monotonic()
            while self._patient.tick < self._ticks - 1:
                self._patient.hear(within_s=_WAIT_S)
                if monotonic() - waiting_since_s > _WAIT_S:
                    raise RuntimeError(f"the patient gave no sign for {_WAIT_S:g} s")
        self._watch_lateness(now_s)
        with self._lock:
            for name, felt in self._patient.felt.items():
                self._arms[name].jaw.measured_rad = felt.jaw_rad

    def _targets(self) -> dict[str, TipTarget]:
        targets: dict[str, TipTarget] = {}
        for name, arm in self._arms.items():
            felt = self._patient.felt.get(name)
            pull_n = NO_FORCE if felt is None else -felt.force_n
            targets[name] = TipTarget(arm.drive.tip(pull_n), arm.jaw.setpoint_rad)
        return targets

    def _watch_lateness(self, now_s: float) -> None:
        behind_s = (self._ticks - self._patient.tick) * WORLD_TICK_S
        if behind_s > LATE_AFTER_S and self._late_since_s is None:
            self._late_since_s = now_s
            self._say(
                f"The patient's world falls behind: at {now_s:.1f} s it is {behind_s:.2f} s late. "
                "A simulated clock (--clock simulated) waits for it."
            )
        elif behind_s < LATE_AFTER_S / 2 and self._late_since_s is not None:
            self._say(f"The patient's world has caught up at {now_s:.1f} s.")
            self._late_since_s = None

    def _clock_publisher(self) -> Callable[[float], None]:
        clock_type = ros_module("rosgraph_msgs.msg").Clock
        out = self.rospy.Publisher("/clock", clock_type, queue_size=10, tcp_nodelay=True)

        def publish(ros_s: float) -> None:
            out.publish(clock_type(self.rospy.Time.from_sec(ros_s)))

        return publish

    def _stamp_s(self) -> float:
        return self._pace.start_s + self._pace.now_s()

    def _arm(self, order: StandInOrder, name: ArmName) -> Psm:
        part = order.actual.arms[name]
        rcm_m = np.array(part.rcm_m)
        down = Pose(np.array(part.home_tip_m) - rcm_m, tip_pose(np.zeros(6)).rotation)
        layers = Layers.of({**order.actual.model.extension, **order.imperfections.extension})
        return Psm(
            name.upper(),
            rcm_m,
            joints_near(down, np.zeros(6)),
            layers.arm,
            jaw_rad=JAW_CLOSED_RAD,
            period_s=PERIOD_S,
            operating=order.operating,
        )

    def _force(self, name: str) -> Callable[[], Floats]:
        """What motor currents tell of the force on the tip, along the reported frame's axes."""

        def measure() -> Floats:
            felt = self._patient.felt.get(name)
            pull_n = NO_FORCE if felt is None else -felt.force_n
            rotation = self._arms[name].drive.tip(NO_FORCE).rotation
            noise_n: Floats = self._noise_n * self._rng.standard_normal(3)
            return rotation.T @ pull_n + noise_n

        return measure
