"""Rehearsal of a retraction: what would come of grasping here and moving so, on the twin alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from defras_sim.camera.ray_caster import RayCaster
from defras_sim.camera.visibility import roi_visibility
from defras_sim.effects.extended_tissue import ExtendedSnapshot, ExtendedTissue
from defras_sim.effects.layers import Layers
from defras_sim.geometry import Floats, Pose
from defras_sim.held_motion import HeldMotion
from defras_sim.motion import manoeuvre_target_m
from defras_sim.scene import ArmName, GraspPoint, Scene
from defras_sim.tissue.model import NothingToGrasp
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


@dataclass(frozen=True)
class _Stage:
    """Where a rehearsal stands: tissue, arms, world time, and what came of it so far."""

    tissue: ExtendedSnapshot
    motion: HeldMotion
    time_s: float
    forces_n: Mapping[str, Floats]
    result: Rehearsal


class Rehearser:
    """Rehearses many retractions of one scene; what two of them have in common is solved once.

    Arms, grasps and tissue have the effects that the scene adopts. World time is that of motion at
    ``motion.tissue_speed_m_s``, and begins with the grasp.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        step_m: float = 0.003,
        stop_when_exposed: bool = False,
    ) -> None:
        self._scene = scene
        self._step_m = step_m
        self._enough = scene.thresholds.roi_visibility if stop_when_exposed else np.inf
        self._layers = Layers.of(scene.model.extension)
        self._tissue = ExtendedTissue(scene, self._layers.tissue, residual_share=_RESIDUAL_SHARE)
        self._rest = self._tissue.snapshot()
        self._known: dict[tuple[str, ...], _Stage] = {}
        """Stages of the point rehearsed last, by manoeuvres done."""
        self._point: GraspPoint | None = None

    def run(
        self, point: GraspPoint, manoeuvres: Sequence[str], *, most_force_n: float = np.inf
    ) -> Rehearsal:
        """One rehearsal; cheapest if those of one point follow one another.

        It ends with the step whose grasp force is above ``most_force_n``, which for one point may
        only fall from one rehearsal to the next: what was ended is not gone through again.
        """
        if point != self._point:
            self._start(point)
        done: tuple[str, ...] = ()
        result = self._known[done].result
        for manoeuvre in manoeuvres:
            if not result.finished or result.best_visibility >= self._enough:
                break
            if result.force_max_n > most_force_n:
                break
            ahead = (*done, manoeuvre)
            if ahead not in self._known:
                self._known[ahead] = self._carry_out(self._known[done], manoeuvre, most_force_n)
            done, result = ahead, self._known[ahead].result
        return result

    def _start(self, point: GraspPoint) -> None:
        self._tissue.restore(self._rest)
        arm = arm_for(self._scene, point)
        tip_m = self._scene.grasp_point_m(*point)
        motion = HeldMotion(self._scene, self._layers)
        motion.follow({arm: Pose(tip_m, POINTING_DOWN)}, 0.0)
        jaw, takes = motion.take(arm, 0.0), True
        try:
            self._tissue.grasp(arm, jaw)
        except NothingToGrasp:  # an arm may be registered so wrongly that it misses the tissue
            motion.let_go(arm)
            takes = False
        state = self._tissue.solve(motion.held(0.0, {}), 0.0)
        hidden = roi_visibility(self._scene, RayCaster(state.surface))
        finished = takes and state.converged
        start = Rehearsal(arm, point, (), (), (), hidden, tip_m, tip_m, finished)
        self._point = point
        self._known = {(): _Stage(self._tissue.snapshot(), motion, 0.0, {}, start)}

    def _carry_out(self, stage: _Stage, manoeuvre: str, most_force_n: float) -> _Stage:
        """One manoeuvre more."""
        self._tissue.restore(stage.tissue)
        motion, time_s, before = stage.motion.copy(), stage.time_s, stage.result
        best, best_at_m, tip_m = before.best_visibility, before.best_at_m, before.stopped_at_m
        goal_m = manoeuvre_target_m(self._scene, manoeuvre, tip_m)
        visibility, force_n, finished = before.visibility[-1:] or (best,), 0.0, True
        seen, forces_n = visibility[0], stage.forces_n
        for next_m in _steps(tip_m, goal_m, self._step_m):
            way_m = float(np.linalg.norm(next_m - tip_m))
            time_s += way_m / self._scene.motion.tissue_speed_m_s
            motion.follow({before.arm: Pose(next_m, POINTING_DOWN)}, time_s)
            state = self._tissue.solve(motion.held(time_s, forces_n), time_s)
            if not state.converged:
                finished = False
                break
            tip_m, forces_n = next_m, state.grasp_forces_n
            force_n = max(force_n, _force_n(state))
            seen = roi_visibility(self._scene, RayCaster(state.surface))
            if seen > best:
                best, best_at_m = seen, tip_m
            if seen >= self._enough or force_n > most_force_n:
                break
        result = Rehearsal(
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
        return _Stage(self._tissue.snapshot(), motion, time_s, forces_n, result)


def _steps(start_m: Floats, goal_m: Floats, step_m: float) -> Iterator[Floats]:
    count = max(1, int(np.ceil(np.linalg.norm(goal_m - start_m) / step_m)))
    for index in range(1, count + 1):
        yield start_m + (goal_m - start_m) * (index / count)


def _force_n(state: TissueState) -> float:
    return max((float(np.linalg.norm(f)) for f in state.grasp_forces_n.values()), default=0.0)
