"""Rehearsal of a retraction: what would come of grasping here and moving so, on the twin alone."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from defras_sim.camera.ray_caster import RayCaster
from defras_sim.camera.visibility import roi_visibility
from defras_sim.geometry import Floats, Pose
from defras_sim.motion import manoeuvre_target_m
from defras_sim.scene import ArmName, GraspPoint, Scene
from defras_sim.tissue.model import TissueModel, TissueSnapshot
from defras_sim.tissue.state import TissueState
from defras_sim.worlds.kinematic_tool import POINTING_DOWN

# Looser than the twin's: forces stay within 0.1 %, and a rehearsal takes two thirds of the time.
_RESIDUAL_SHARE = 1e-3

SEQUENCES: tuple[tuple[str, ...], ...] = (
    ("pull",),
    ("pull", "fold"),
    ("pull", "move"),
    ("pull", "move", "fold"),
)
"""Orders of manoeuvres that a retraction can follow."""


@dataclass(frozen=True)
class Rehearsal:
    """What came of one simulated retraction.

    ``visibility`` (0..1) and ``force_max_n`` have one value per manoeuvre begun: at its end, and
    during it. ``best_visibility`` is the highest on the way, first seen with the tip at
    ``best_at_m`` (3,). ``stopped_at_m`` is where the tip ended. ``finished`` is False where the
    tissue model could not follow the last manoeuvre listed in ``visibility`` to its end.
    """

    arm: ArmName
    point: GraspPoint
    manoeuvres: tuple[str, ...]
    visibility: tuple[float, ...]
    forces_n: tuple[float, ...]
    best_visibility: float
    best_at_m: Floats
    stopped_at_m: Floats
    finished: bool

    @property
    def force_max_n(self) -> float:
        """Largest grasp force of the whole retraction."""
        return max(self.forces_n, default=0.0)


def arm_for(scene: Scene, point: GraspPoint) -> ArmName:
    """The arm on whose side of the x-z plane ``point`` lies; the first of both on the plane.

    Raises:
        ValueError: no arm of the scene works on that side.
    """
    arms = scene.arms_at(*point)
    if not arms:
        y_m = scene.grasp_xy_m(*point)[1]
        raise ValueError(f"no arm works on the side of grasp point {point} (y = {y_m:.4f} m)")
    return arms[0]


def rehearse(
    scene: Scene,
    grasp_point: GraspPoint,
    manoeuvres: Sequence[str],
    *,
    step_m: float = 0.003,
    stop_when_exposed: bool = False,
) -> Rehearsal:
    """Grasp at ``grasp_point`` (column, row), then carry out ``manoeuvres`` on ``scene``'s tissue.

    With ``stop_when_exposed`` the motion ends where ``thresholds.roi_visibility`` is reached, as
    it does in a real run.
    """
    rehearser = Rehearser(scene, step_m=step_m, stop_when_exposed=stop_when_exposed)
    return rehearser.run(grasp_point, manoeuvres)


class Rehearser:
    """Rehearses many retractions of one scene; what two of them have in common is solved once."""

    def __init__(
        self,
        scene: Scene,
        *,
        step_m: float = 0.003,
        stop_when_exposed: bool = False,
        most_force_n: float = np.inf,
    ) -> None:
        """A retraction ends with the step whose grasp force is above ``most_force_n``."""
        self._scene = scene
        self._most_force_n = most_force_n
        self._step_m = step_m
        self._enough = scene.thresholds.roi_visibility if stop_when_exposed else np.inf
        self._model = TissueModel(scene, residual_share=_RESIDUAL_SHARE)
        self._rest = self._model.snapshot()
        self._known: dict[tuple[str, ...], tuple[TissueSnapshot, Rehearsal]] = {}
        """Model snapshots and results of the point rehearsed last, by manoeuvres done."""
        self._point: GraspPoint | None = None

    def run(self, point: GraspPoint, manoeuvres: Sequence[str]) -> Rehearsal:
        """One rehearsal; cheapest if those of one point follow one another."""
        if point != self._point:
            self._start(point)
        done: tuple[str, ...] = ()
        result = self._known[done][1]
        for manoeuvre in manoeuvres:
            if not result.finished or result.best_visibility >= self._enough:
                break
            if result.force_max_n > self._most_force_n:
                break
            ahead = (*done, manoeuvre)
            if ahead not in self._known:
                self._model.restore(self._known[done][0])
                after = self._carry_out(result, manoeuvre)
                self._known[ahead] = (self._model.snapshot(), after)
            done, result = ahead, self._known[ahead][1]
        return result

    def _start(self, point: GraspPoint) -> None:
        self._model.restore(self._rest)
        arm = arm_for(self._scene, point)
        tip_m = self._scene.grasp_point_m(*point)
        self._model.grasp(arm, Pose(tip_m, POINTING_DOWN))
        state = self._model.solve({arm: Pose(tip_m, POINTING_DOWN)})
        hidden = roi_visibility(self._scene, RayCaster(state.surface))
        start = Rehearsal(arm, point, (), (), (), hidden, tip_m, tip_m, state.converged)
        self._point = point
        self._known = {(): (self._model.snapshot(), start)}

    def _carry_out(self, before: Rehearsal, manoeuvre: str) -> Rehearsal:
        """``before`` and one manoeuvre more; the model stands where ``before`` ended."""
        best, best_at_m, tip_m = before.best_visibility, before.best_at_m, before.stopped_at_m
        goal_m = manoeuvre_target_m(self._scene, manoeuvre, tip_m)
        visibility, force_n, finished = before.visibility[-1:] or (best,), 0.0, True
        seen = visibility[0]
        for next_m in _steps(tip_m, goal_m, self._step_m):
            state = self._model.solve({before.arm: Pose(next_m, POINTING_DOWN)})
            if not state.converged:
                finished = False
                break
            tip_m = next_m
            force_n = max(force_n, _force_n(state))
            seen = roi_visibility(self._scene, RayCaster(state.surface))
            if seen > best:
                best, best_at_m = seen, tip_m
            if seen >= self._enough or force_n > self._most_force_n:
                break
        return Rehearsal(
            arm=before.arm,
            point=before.point,
            manoeuvres=(*before.manoeuvres, manoeuvre),
            visibility=(*before.visibility, seen),
            forces_n=(*before.forces_n, force_n),
            best_visibility=best,
            best_at_m=best_at_m,
            stopped_at_m=tip_m,
            finished=finished,
        )


def _steps(start_m: Floats, goal_m: Floats, step_m: float) -> Iterator[Floats]:
    count = max(1, int(np.ceil(np.linalg.norm(goal_m - start_m) / step_m)))
    for index in range(1, count + 1):
        yield start_m + (goal_m - start_m) * (index / count)


def _force_n(state: TissueState) -> float:
    return max((float(np.linalg.norm(f)) for f in state.grasp_forces_n.values()), default=0.0)
