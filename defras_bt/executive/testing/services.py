"""Twin, monitor, planner, estimator and rehearsal that say what a test wants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from defras_bt.diagnosis.mismatch.finding import MismatchCause, MismatchFinding
from defras_bt.learning.estimate import AttachmentEstimate, AttachmentEstimator, Keyframe
from defras_bt.learning.probe.choice import Tug
from defras_bt.monitoring.reading import MonitorReading
from defras_bt.planning.plan import MANOEUVRES, Action, GridPoint, Plan, Situation
from defras_bt.planning.planner import NoPlan
from defras_sim.geometry import Pose
from defras_sim.retraction import Rehearsal
from defras_sim.scene import Scene
from defras_sim.surface import Surface
from defras_sim.tissue.state import TissueState
from defras_sim.worlds.protocol import PointCloud

MU_M = (0.0005, 0.003, 0.005, 0.007)
"""A discrepancy [m] in the middle of each warning state."""


def flat_state(converged: bool = True) -> TissueState:
    corners = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * 0.06
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    surface = Surface(corners, triangles, np.ones(4, bool), corners[:, :2])
    return TissueState(
        corners, surface, {}, {}, np.zeros((144, 3)), 0.0, np.zeros(3), 0.0, converged, 1
    )


class BenchTwin:
    """Believes ``scene``; a grip feels ``feels_n``. ``broken`` is raised when it should track."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.feels_n = 0.0
        self.broken: Exception | None = None
        self.holding: set[str] = set()
        self.taken: dict[str, Pose] = {}
        self.jaws: dict[str, Pose] = {}
        self.registered: list[Pose] = []

    @property
    def force_n(self) -> float:
        return self.feels_n if self.holding else 0.0

    def grasp(self, arm: str, tissue_from_tip: Pose, time_s: float) -> None:
        self.holding.add(arm)
        self.taken[arm] = self.jaws[arm] = tissue_from_tip

    def release(self, arm: str, time_s: float) -> None:
        self.holding.remove(arm)
        del self.taken[arm], self.jaws[arm]

    def track(self, setpoints: Mapping[str, Pose], time_s: float) -> TissueState:
        if self.broken is not None:
            raise self.broken
        self.jaws = {arm: setpoints[arm] for arm in self.taken}
        return flat_state()

    def corrected(self, cloud: PointCloud) -> PointCloud:
        return cloud

    def set_attached(self, attached: NDArray[np.bool_]) -> None:
        self.scene = self.scene.with_attached(attached)

    def register_camera(self, true_from_reported: Pose) -> None:
        self.registered.append(true_from_reported)


class BenchMonitor:
    """Reports the warning states it is told; calibrated after 3 rest frames.

    ``heals``: a change of the twin takes every warning away, as a good lesson does.
    """

    def __init__(self) -> None:
        self.states = {"local": 0, "median": 0}
        self.mu_m = dict.fromkeys(self.states, MU_M[0])
        self.calibration: dict[str, object] = {}
        self.rest_frames = 0
        self.changes = 0
        self.heals = False
        self.settling = False

    def warn(self, state: int, *metrics: str) -> None:
        for metric in metrics or tuple(self.states):
            self.states[metric], self.mu_m[metric] = state, MU_M[state]

    def observe_rest(self, cloud: PointCloud | None, surface: Surface) -> bool:
        self.rest_frames += cloud is not None
        if self.rest_frames >= 3:
            self.calibration = dict.fromkeys(self.states, "rest value 0.50 mm")
        return bool(self.calibration)

    def reading(self, cloud: PointCloud | None, surface: Surface, time_s: float) -> MonitorReading:
        mu_m = dict(self.mu_m) if cloud is not None else dict.fromkeys(self.mu_m, float("nan"))
        return MonitorReading(time_s, mu_m, dict(self.states))

    def tissue_grasped(self) -> None:
        self.settling = False

    def tissue_released(self, time_s: float) -> None:
        self.settling = True

    def twin_changed(self) -> None:
        self.changes += 1
        if self.heals:
            self.warn(0)

    def camera_registered(self) -> None:
        self.twin_changed()


class BenchPlanner:
    """Retracts with psm1 at the first of ``points`` that is not blocked, or goes on where it holds.

    A held point that is blocked is let go first. ``asked`` notes every situation.
    """

    def __init__(self, points: Sequence[GridPoint] = ((2, 4), (2, 5), (3, 4))) -> None:
        self.points = tuple(points)
        self.asked: list[Situation] = []

    def plan(
        self,
        situation: Situation,
        attached: NDArray[np.bool_],
        *,
        required_grasp: GridPoint | None = None,
    ) -> Plan:
        self.asked.append(situation)
        free = [
            point
            for point in self.points
            if point not in situation.blocked and required_grasp in (None, point)
        ]
        if not free:
            raise NoPlan(12, ["every grasp point is blocked"])
        holding, done = situation.arms["psm1"].holding, situation.arms["psm1"].done
        if holding is not None and holding not in situation.blocked:
            return plan_of(holding, [m for m in situation.exposing if m not in done])
        away = [("release", holding)] if holding is not None else []
        names = ["reach", "open", "grasp", *situation.exposing]
        return _numbered([*away, *((name, free[0]) for name in names)])


def plan_of(point: GridPoint, names: Sequence[str] = MANOEUVRES, arm: str = "psm1") -> Plan:
    return _numbered([(name, point) for name in names], arm)


def _numbered(steps: Sequence[tuple[str, GridPoint]], arm: str = "psm1") -> Plan:
    return Plan(tuple(Action(name, arm, point, t) for t, (name, point) in enumerate(steps, 1)))


class BenchEstimator:
    """Learns nothing until ``adopts`` holds; then it believes ``proposal``."""

    def __init__(self, scene: Scene) -> None:
        self.adopts = False
        self.proposal = ~scene.attached
        self.asked: list[tuple[Scene, Sequence[Keyframe]]] = []

    def estimate(
        self, belief: Scene, keyframes: Sequence[Keyframe], rng: np.random.Generator
    ) -> AttachmentEstimate:
        self.asked.append((belief, keyframes))
        reason = "unseen points agree better" if self.adopts else "unseen points agree no better"
        return AttachmentEstimate(
            attached=self.proposal,
            probability=self.proposal.astype(float),
            held_out_before_m=0.004,
            held_out_after_m=0.001 if self.adopts else 0.005,
            adopted=self.adopts,
            reason=reason,
        )


class BenchMismatch:
    """Blames ``cause``; ``asked`` notes every question, ``estimator`` who came with the last."""

    def __init__(self) -> None:
        self.cause: MismatchCause = "attachments"
        self.estimator: AttachmentEstimator | None = None
        self.asked: list[tuple[Scene, Sequence[Keyframe]]] = []

    def explain(
        self,
        belief: Scene,
        keyframes: Sequence[Keyframe],
        rng: np.random.Generator,
        estimator: AttachmentEstimator,
    ) -> MismatchFinding:
        self.asked.append((belief, keyframes))
        self.estimator = estimator
        moved = Pose(np.array([0.003, 0.0, 0.0])) if self.cause == "camera" else None
        return MismatchFinding(
            self.cause, f"the {self.cause} did it", 0.004, 0.001, true_from_reported=moved
        )


class BenchRehearsal:
    """``shows[point, manoeuvres]``: (visibility, largest force [N]); the rest shows nothing."""

    def __init__(self) -> None:
        self.shows: dict[tuple[GridPoint, tuple[str, ...]], tuple[float, float]] = {}
        self.asked: list[tuple[GridPoint, tuple[str, ...]]] = []

    def __call__(self, scene: Scene, point: GridPoint, manoeuvres: Sequence[str]) -> Rehearsal:
        self.asked.append((point, tuple(manoeuvres)))
        seen, force_n = self.shows.get((point, tuple(manoeuvres)), (0.0, 0.1))
        at_m = np.zeros(3)
        return Rehearsal(
            "psm1", point, tuple(manoeuvres), (seen,), (force_n,), seen, at_m, at_m, True
        )


class BenchProbe:
    """Advises ``tug``; None: no tug is safe. ``asked`` counts the explanations it was given."""

    def __init__(self) -> None:
        self.tug: Tug | None = None
        self.asked: list[int] = []

    def choose(
        self,
        belief: Scene,
        keyframes: Sequence[Keyframe],
        explanations: Sequence[NDArray[np.bool_]],
        force_threshold_n: float,
    ) -> Tug | None:
        self.asked.append(len(explanations))
        return self.tug
