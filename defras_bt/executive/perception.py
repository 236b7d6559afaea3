"""From a world's observation to what the tree is ticked with: sensing, twin, monitoring."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from defras_bt.executive.blackboard import Blackboard, TickInputs
from defras_bt.executive.grips import GripTracker
from defras_bt.learning.buffer import KeyframeBuffer
from defras_bt.monitoring.reading import MonitorReading
from defras_bt.monitoring.warning import WarningMonitor
from defras_bt.recording.operator_state import NOBODY, Mode, OperatorState
from defras_bt.sensing.arms import ArmPlausibility
from defras_bt.sensing.cloud import Workspace
from defras_bt.sensing.freshness import stale
from defras_bt.sensing.latest import LatestReadings
from defras_bt.sensing.sense import SensedObservation, sense
from defras_sim.tissue.state import TissueState
from defras_sim.twin import Twin
from defras_sim.worlds.protocol import Command, Observation, PointCloud


class Perception:
    """Keeps twin, monitor and keyframes in step with the observations."""

    def __init__(
        self,
        board: Blackboard,
        twin: Twin,
        monitor: WarningMonitor,
        keyframes: KeyframeBuffer,
        force_threshold_n: float,
    ) -> None:
        self._board = board
        self._twin = twin
        self._monitor = monitor
        self._keyframes = keyframes
        self._force_threshold_n = force_threshold_n
        self._grips = GripTracker(board, twin)
        self._touched = False
        self._latest = LatestReadings(twin.scene)
        self._arms = ArmPlausibility(twin.scene)
        self._time_s = -np.inf
        # Learning changes what is believed to hold the tissue, never its shape.
        self._workspace = Workspace.of(twin.scene)

    def update(
        self, tick: int, observation: Observation, operator: OperatorState = NOBODY
    ) -> TickInputs:
        """Everything the tree may know at this tick."""
        scene, board = self._twin.scene, self._board
        sensed = sense(self._latest.update(observation), scene, workspace=self._workspace)
        missing = {
            **self._standstill(sensed.time_s),
            **self._arms.faults(sensed, driven_by_hand=operator.mode is Mode.TAKEN_OVER),
            **stale(sensed, scene),
            **sensed.stopped,
        }
        if self._grips.update(sensed, unsound=missing):
            self._touched = True
            self._keyframes.clear()
            self._monitor.twin_changed()
            if board.grips:
                self._monitor.tissue_grasped()
            else:
                self._monitor.tissue_released(sensed.time_s)
        missing |= self._grips.contradictions
        # Where nobody knows what a holding arm does, the twin cannot say what the tissue does.
        state, force_n, reading = None, float("nan"), None
        if not any(name in missing for name in board.grips):
            setpoints = {n: arm.setpoint_tissue_from_tip for n, arm in sensed.arms.items()}
            state = self._twin.track(setpoints, sensed.time_s)
            force_n = self._twin.force_n
            # What is recorded is what was reported; what is compared is what that means.
            cloud = None if sensed.cloud is None else self._twin.corrected(sensed.cloud)
            reading = self._monitored(cloud, state, sensed.time_s)
            if board.grips and "cloud" not in missing:
                self._keyframes.add(
                    sensed.time_s,
                    self._twin.taken,
                    self._twin.jaws,
                    cloud,
                )
        self._count_force(force_n, scene.tick_s)
        return TickInputs(
            tick=tick,
            time_s=sensed.time_s,
            observation=sensed,
            missing=_sentences(sensed, missing.values()),
            twin=state,
            force_n=force_n,
            force_threshold_n=self._force_threshold_n,
            reading=reading,
            operator=operator,
            force_over_s=board.force_over_s,
        )

    def sent(self, time_s: float, command: Command) -> None:
        """``command`` went to the arms at the tick of ``time_s``: they have to follow it."""
        self._arms.sent(time_s, command)

    def _standstill(self, time_s: float) -> Mapping[str, str]:
        """A clock that does not move on makes every old reading look fresh."""
        before_s, self._time_s = self._time_s, time_s
        if time_s > before_s:
            return {}
        return {"clock": f"the world's clock stands still at {time_s:.2f} s"}

    def _monitored(
        self, cloud: PointCloud | None, state: TissueState, time_s: float
    ) -> MonitorReading | None:
        # Tissue that was held once may lie otherwise: rest is what was seen before.
        if not self._board.rest_calibrated and not self._touched:
            self._monitor.observe_rest(cloud, state.surface)
        if not self._monitor.calibration:
            return None
        return self._monitor.reading(cloud, state.surface, time_s)

    def _count_force(self, force_n: float, tick_s: float) -> None:
        # So written, a force or a threshold that is not a number counts as over.
        over = not force_n <= self._force_threshold_n
        self._board.force_over_s = self._board.force_over_s + tick_s if over else 0.0


def _sentences(sensed: SensedObservation, stale_readings: Iterable[str]) -> tuple[str, ...]:
    """What is missing, in words; a fault explains only a reading that is missing because of it."""
    late = tuple(stale_readings)
    return (*late, *sensed.faults) if late else ()
