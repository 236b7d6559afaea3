"""What a node may use: the blackboard, and the services of one executive."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from defras_bt.diagnosis.mismatch.finding import MismatchService
from defras_bt.executive.blackboard import Blackboard
from defras_bt.learning.chain.estimators import EstimatorName
from defras_bt.learning.estimate import AttachmentEstimator, Keyframe
from defras_bt.learning.probe.choice import Tug
from defras_bt.planning.plan import GridPoint, Plan, Situation
from defras_sim.geometry import Pose
from defras_sim.retraction import Rehearsal
from defras_sim.scene import Scene


class PlanningService(Protocol):
    """Finds the shortest plan from a situation, or raises NoPlan."""

    def plan(
        self,
        situation: Situation,
        attached: NDArray[np.bool_],
        *,
        required_grasp: GridPoint | None = None,
    ) -> Plan: ...


class TwinService(Protocol):
    """The part of the twin that nodes may touch: what it believes."""

    @property
    def scene(self) -> Scene: ...

    def set_attached(self, attached: NDArray[np.bool_]) -> object: ...

    def register_camera(self, true_from_reported: Pose) -> None:
        """What the camera reports lies moved by the pose from now on."""


class MonitorService(Protocol):
    """The part of monitoring that nodes may touch."""

    @property
    def calibration(self) -> Mapping[str, object]:
        """What each metric says at rest; empty until enough rest frames were seen."""

    def twin_changed(self) -> None:
        """Forget what was seen with the twin as it was before it learned."""

    def camera_registered(self) -> None:
        """As :meth:`twin_changed`; and rest was seen by a camera elsewhere."""


class KeyframeService(Protocol):
    """Observed shapes since the last grasp."""

    def frames(self) -> Sequence[Keyframe]: ...

    def clear(self) -> None: ...


class ProbeService(Protocol):
    """Finds the small, safe tug that tells most about what holds the tissue."""

    def choose(
        self,
        belief: Scene,
        keyframes: Sequence[Keyframe],
        explanations: Sequence[NDArray[np.bool_]],
        force_threshold_n: float,
    ) -> Tug | None: ...


Rehearse = Callable[[Scene, GridPoint, Sequence[str]], Rehearsal]


@dataclass(frozen=True)
class Context:
    """Services of one executive.

    ``estimator`` gives an estimator of the attachments by its name. ``approve`` asks the operator
    before a plan is carried out: None means not answered yet, ask again in the next tick.
    """

    board: Blackboard
    twin: TwinService
    monitor: MonitorService
    planner: PlanningService
    estimator: Callable[[EstimatorName], AttachmentEstimator]
    mismatch: MismatchService
    keyframes: KeyframeService
    rehearse: Rehearse
    probe: ProbeService
    rng: np.random.Generator
    preoperative: Plan | None = None
    approve: Callable[[Plan], bool | None] = field(default=lambda plan: True)

    @property
    def scene(self) -> Scene:
        """The scene as believed now, learned attachments included."""
        return self.twin.scene
