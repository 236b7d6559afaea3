"""The stand-in put together: two arms at 100 Hz, and the patient's process beside them."""

from __future__ import annotations

import os
from collections.abc import Callable
from threading import Event
from time import monotonic

import numpy as np

from defras_bt.dvrk.ros_packages import ros_module
from defras_bt.dvrk.stand_in.arm_station import ArmStation
from defras_bt.dvrk.stand_in.delivery import Delivery
from defras_bt.dvrk.stand_in.drive import joints_near
from defras_bt.dvrk.stand_in.fault_topic import take_orders
from defras_bt.dvrk.stand_in.menu import Menu
from defras_bt.dvrk.stand_in.order import PERIOD_S, StandInOrder
from defras_bt.dvrk.stand_in.pacing import Pace, RealPace, SimulatedPace
from defras_bt.dvrk.stand_in.patient_process import Motion, PatientOrder, PatientProcess
from defras_bt.dvrk.stand_in.psm import Psm
from defras_bt.dvrk.stand_in.ros_node import join
from defras_bt.dvrk.stand_in.witness import Witness
from defras_bt.dvrk.transport.ros1_node import require_master
from defras_sim.arm.kinematics import tip_pose
from defras_sim.effects.layers import Layers
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import ArmName
from defras_sim.worlds.force_sensor import NO_FORCE
from defras_sim.worlds.protocol import JAW_CLOSED_RAD

NODE = "defras_arms"

LATE_AFTER_S = 0.25
"""A patient this far behind the arms is said to fall behind."""

_WAIT_S = 30.0
_PRIORITY = 10
"""Of the process of the arms, 1 to 99; below that of a client's stream."""


class StandIn:
    """Arms and patient on a ROS master. A process can hold one."""

    def __init__(self, order: StandInOrder, say: Callable[[str], None]) -> None:
        """``say`` takes sentences for whoever watches.

        Raises:
            ConnectionFailed: no ROS master answers.
            RosMissing: ROS 1 is not installed.
            PatientLost: the patient's world does not come up.
            OSError: the witness's file cannot be written.
        """
        self._say = say
        self._stop = Event()
        self._order = order
        arms_rng, force_rng, delivery_rng = np.random.default_rng([order.seed, 1]).spawn(3)
        self._witness = Witness(order.witness)
        require_master(order.master_uri)
        arms = {name: _arm(order, name, arms_rng) for name in order.actual.arms}
        self._patient = PatientProcess(
            PatientOrder(order, {name: arm.drive.tip(NO_FORCE) for name, arm in arms.items()})
        )
        # Threads inherit this, so before the first one of rospy; the patient must not.
        if not _goes_first():
            say(
                "The system lets the arms run beside other programs only: under load they are late."
            )
        self._rospy = join(order.master_uri, NODE, simulated_clock=order.simulated_clock)
        publish_clock = self._clock_publisher() if order.simulated_clock else None
        if publish_clock is None:
            self._pace: Pace = RealPace(PERIOD_S)
        else:
            self._pace = SimulatedPace(PERIOD_S, order.speed, publish_clock)
        self._patient.begin(self._pace.start_s)
        self._witness.tell("clock", 0.0, start_s=self._pace.start_s)
        self._menu = Menu(order.faults)
        self._delivery = Delivery(self._menu, delivery_rng, self._pace.start_s)

        def force_noise_n() -> Floats:
            return order.imperfections.force_noise_sd_n * force_rng.standard_normal(3)

        self._stations: dict[str, ArmStation] = {
            name: ArmStation(
                self._rospy, arm, name, self._pace, self._delivery, self._witness, force_noise_n
            )
            for name, arm in arms.items()
        }
        take_orders(self._rospy, self._menu, self._pace.now_s, say)
        self._ticks = 0
        self._late = False

    def run(self) -> None:
        """Stand in until :meth:`stop`.

        Raises:
            PatientLost: the patient's world cannot go on.
        """
        try:
            while not self._stop.is_set() and not self._rospy.is_shutdown():
                passed_s = self._pace.next_period_s()
                self._turn_faults()
                for station in self._stations.values():
                    station.advance(passed_s)
                self._keep_up()
                for station in self._stations.values():
                    station.publish()
                self._delivery.flush(self._pace.now_s())
        finally:
            self._patient.close()
            self._witness.close()
            self._rospy.signal_shutdown("the stand-in ends")

    def stop(self) -> None:
        """End :meth:`run`; may be called from anywhere."""
        self._stop.set()

    def _turn_faults(self) -> None:
        now_s = self._pace.now_s()
        for turn in self._menu.turns(now_s):
            for station in self._stations.values():
                station.turn(turn)
            told = turn.fault.model_dump(mode="json", exclude_none=True)
            self._witness.tell("fault", now_s, begins=turn.begins, **told)
            verb = "begins" if turn.begins else "ends"
            self._say(f"At {now_s:.2f} s a fault {verb}: {told}")

    def _keep_up(self) -> None:
        """Tell the patient of every tick that has passed, and hear what it answers."""
        now_s = self._pace.now_s()
        while (self._ticks + 1) * self._order.world_tick_s <= now_s + 1e-9:
            self._ticks += 1
            targets = {name: station.target() for name, station in self._stations.items()}
            self._patient.tell(Motion(self._ticks, targets))
        self._patient.hear()
        if self._order.simulated_clock:
            self._wait_for_patient()
        self._watch_lateness(now_s)
        for name, felt in self._patient.felt.items():
            self._stations[name].feel(felt)

    def _wait_for_patient(self) -> None:
        """Simulated time never runs more than one tick ahead of the patient."""
        since_s = monotonic()
        while self._patient.tick < self._ticks - 1:
            self._patient.hear(within_s=1.0)
            if monotonic() - since_s > _WAIT_S:
                raise RuntimeError(f"the patient gave no sign for {_WAIT_S:g} s")

    def _watch_lateness(self, now_s: float) -> None:
        behind_s = (self._ticks - self._patient.tick) * self._order.world_tick_s
        if behind_s > LATE_AFTER_S and not self._late:
            self._late = True
            self._say(
                f"The patient's world falls behind: at {now_s:.1f} s it is {behind_s:.2f} s late. "
                "A simulated clock (--clock simulated) waits for it."
            )
        elif behind_s < LATE_AFTER_S / 2 and self._late:
            self._late = False
            self._say(f"The patient's world has caught up at {now_s:.1f} s.")

    def _clock_publisher(self) -> Callable[[float], None]:
        clock_type = ros_module("rosgraph_msgs.msg").Clock
        out = self._rospy.Publisher("/clock", clock_type, queue_size=10, tcp_nodelay=True)

        def publish(ros_s: float) -> None:
            out.publish(clock_type(self._rospy.Time.from_sec(ros_s)))

        return publish


def _goes_first() -> bool:
    """Have this process run before others, as an arm's own computer would; whether it does."""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    except (OSError, AttributeError):
        return False  # only some systems have it, and only some users may
    return True


def _arm(order: StandInOrder, name: ArmName, rng: np.random.Generator) -> Psm:
    part, imperfect = order.actual.arms[name], order.imperfections
    rcm_m = np.array(part.rcm_m)
    down = Pose(np.array(part.home_tip_m) - rcm_m, tip_pose(np.zeros(6)).rotation)

    def encoder_noise() -> Floats:
        return imperfect.encoder_noise_rad * rng.standard_normal(6)

    return Psm(
        name.upper(),
        rcm_m,
        joints_near(down, np.zeros(6)),
        Layers.of({**order.actual.model.extension, **imperfect.extension}).arm,
        jaw_rad=JAW_CLOSED_RAD,
        period_s=PERIOD_S,
        operating=order.operating,
        encoder_noise=encoder_noise,
    )
