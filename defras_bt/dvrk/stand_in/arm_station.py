"""One arm at its place in the stand-in: its time, its topics, its faults, and who commands it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from threading import RLock
from typing import Any

import numpy as np

from defras_bt.dvrk.stand_in.arm_goals import listen
from defras_bt.dvrk.stand_in.arm_topics import ArmTopics
from defras_bt.dvrk.stand_in.delivery import Delivery
from defras_bt.dvrk.stand_in.faults import ArmStops, SecondClient
from defras_bt.dvrk.stand_in.menu import Turn
from defras_bt.dvrk.stand_in.pacing import Pace
from defras_bt.dvrk.stand_in.patient import ArmFeedback, TipTarget
from defras_bt.dvrk.stand_in.psm import Psm, PsmReading
from defras_bt.dvrk.stand_in.refusal import Refused
from defras_bt.dvrk.stand_in.second_commander import SecondCommander
from defras_bt.dvrk.stand_in.witness import Witness
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import ArmName
from defras_sim.worlds.force_sensor import NO_FORCE

_STATE_COMMANDS: Mapping[tuple[str, bool], str] = {
    ("paused", True): "pause",
    ("paused", False): "resume",
    ("fault", False): "enable",
    ("unhomed", True): "unhome",
    ("unhomed", False): "home",
}


class ArmStation:
    """Goals come in on threads of rospy; a lock keeps them apart from the arm's own time."""

    def __init__(
        self,
        rospy: Any,
        arm: Psm,
        name: ArmName,
        pace: Pace,
        delivery: Delivery,
        witness: Witness,
        force_noise_n: Callable[[], Floats],
    ) -> None:
        """``force_noise_n`` gives the noise (3,) of one reading of forces from motor currents."""
        self._arm, self._name, self._pace = arm, name, pace
        self._witness, self._force_noise_n = witness, force_noise_n
        self._lock = RLock()
        self._topics = ArmTopics(rospy, name, delivery)
        self._felt: ArmFeedback | None = None
        self._goal: Pose | None = None
        self._rospy = rospy
        self._other: SecondCommander | None = None
        self._listening = listen(rospy, arm, name.upper(), self._heed)

    def advance(self, time_s: float) -> None:
        """Let ``time_s`` pass for the arm."""
        with self._lock:
            if self._other is not None:
                self._other.go_on(time_s, self._pace.ros_s())
            self._arm.advance(time_s)

    def publish(self) -> None:
        """Everything that the arm publishes in one period."""
        with self._lock:
            reading, force_n = self._arm.reading(), self._measured_force_n()
            self._topics.publish(reading, force_n, self._pace.now_s(), self._pace.ros_s)

    def target(self) -> TipTarget:
        """Where tip and jaw truly are, for the patient."""
        with self._lock:
            pull_n = NO_FORCE if self._felt is None else -self._felt.force_n
            target = TipTarget(self._arm.drive.tip(pull_n), self._arm.jaw.setpoint_rad)
            self._testify(self._arm.reading(), target)
            return target

    def feel(self, felt: ArmFeedback) -> None:
        """What the tissue does to the arm."""
        with self._lock:
            self._felt = felt
            self._arm.jaw.measured_rad = felt.jaw_rad

    def turn(self, turn: Turn) -> None:
        """A fault of this arm begins or ends; those of others are ignored."""
        fault = turn.fault
        with self._lock:
            if isinstance(fault, SecondClient) and fault.arm == self._name:
                self._change_other(fault.speed_m_s if turn.begins else None)
            if not isinstance(fault, ArmStops) or fault.arm != self._name:
                return
            try:
                if fault.fault == "fault" and turn.begins:
                    self._arm.fail()
                else:
                    self._arm.state_command(_STATE_COMMANDS[fault.fault, turn.begins])
            except Refused as why:
                # Somebody brought the arm into another state while the fault lasted.
                self._topics.say(str(why), self._pace.ros_s)
            self._publish_state()

    def _change_other(self, speed_m_s: float | None) -> None:
        """A second client begins, or ends."""
        if self._other is not None:
            self._other.close()
            self._other = None
        if speed_m_s is not None:
            begin = self._arm.reading().setpoint
            self._other = SecondCommander(self._rospy, self._name.upper(), begin, speed_m_s)

    def _heed(self, command: str, act: Callable[[], None], node: str) -> None:
        refused = ""
        with self._lock:
            before, jaw_rad = self._arm.reading().setpoint, self._arm.jaw.goal_rad
            try:
                act()
            except Refused as why:
                refused = str(why)
            after = self._arm.reading()
            now_s = self._pace.now_s()
            # A move makes the arm busy before anything else is heard of it.
            self._publish_state()
        way_m = float(np.linalg.norm(after.setpoint.position_m - before.position_m))
        facts: dict[str, Any] = {"refused": refused} if refused else {}
        if node == self._rospy.get_name():
            facts["by"] = "second client"
        turned = self._arm.jaw.goal_rad - jaw_rad
        self._witness.tell(
            "goal", now_s, arm=self._name, command=command, way_m=way_m, jaw=turned, **facts
        )
        if refused:
            self._topics.say(refused, self._pace.ros_s)

    def _publish_state(self) -> None:
        operating = self._arm.reading().operating
        self._topics.publish_state(operating, self._pace.now_s(), self._pace.ros_s)

    def _measured_force_n(self) -> Floats:
        """What motor currents tell of the force on the tip, along the reported frame's axes."""
        noise_n = self._force_noise_n()
        if self._felt is None:
            return noise_n
        return self._arm.drive.tip(NO_FORCE).rotation.T @ -self._felt.force_n + noise_n

    def _testify(self, reading: PsmReading, target: TipTarget) -> None:
        self._witness.tell(
            "arm",
            self._pace.now_s(),
            arm=self._name,
            setpoint_m=[round(v, 7) for v in reading.setpoint.position_m.tolist()],
            tip_m=[round(v, 7) for v in target.tissue_from_tip.position_m.tolist()],
            jaw_rad=reading.jaw_rad,
            jaw_setpoint_rad=reading.jaw_setpoint_rad,
            grasped=self._felt is not None and self._felt.grasped,
            force_n=0.0 if self._felt is None else float(np.linalg.norm(self._felt.force_n)),
            state=reading.operating.state,
            is_homed=reading.operating.is_homed,
        )
