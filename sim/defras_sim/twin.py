"""Twin: predicts what the sensors should say from the commanded motion and the believed scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Pose
from defras_sim.scene import RIGID_HOLE_N_PER_M, Scene
from defras_sim.tissue.model import NothingToGrasp, TissueModel
from defras_sim.tissue.state import TissueState

Mask = NDArray[np.bool_]

# Stiffnesses through which a hole that starts (or stops) to hold is led: the tissue under a hole
# gives way near 40 N/m, so most of the change of shape happens between 1 and 1000 N/m.
_RAMP_N_PER_M = np.array([1.0, 4.0, 10.0, 25.0, 60.0, 150.0, 500.0, RIGID_HOLE_N_PER_M])


@dataclass(frozen=True)
class _Grip:
    """An arm that holds: its tip when the jaw closed, and the other holding tips at that time."""

    arm: str
    tip: Pose
    others: Mapping[str, Pose]


class Twin:
    """The believed tissue, led along by the arms' setpoints.

    Example:
        >>> twin = Twin(scene)
        >>> twin.grasp("psm1", setpoints["psm1"])
        >>> state = twin.track(setpoints, time_s)
        >>> state.surface, twin.force_n
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._model = TissueModel(scene)
        self._grips: list[_Grip] = []
        self._tips: dict[str, Pose] = {}
        """Holding tips that were last asked for; not reached while the state is stale."""
        self._state = self._model.solve({})

    @property
    def scene(self) -> Scene:
        """The scene as believed now."""
        return self._scene

    @property
    def state(self) -> TissueState:
        """The last predicted state; stale where ``converged`` is False."""
        return self._state

    @property
    def holding(self) -> tuple[str, ...]:
        """Arms that hold tissue, in the order in which they took it."""
        return tuple(grip.arm for grip in self._grips)

    @property
    def force_n(self) -> float:
        """Largest force of a grasp on the tissue; 0 without a grasp, NaN while stale."""
        if not self._state.converged:
            return float("nan")
        forces = self._state.grasp_forces_n.values()
        return max((float(np.linalg.norm(force)) for force in forces), default=0.0)

    def grasp(self, arm: str, tissue_from_tip: Pose) -> None:
        """``arm`` takes the tissue at its tip.

        Raises:
            ValueError: the arm holds already, or its tip is not on the believed tissue.
        """
        if arm in self.holding:
            raise ValueError(f"{arm} holds tissue already; release it first")
        self._model.grasp(arm, tissue_from_tip)
        self._grips.append(_Grip(arm, tissue_from_tip, self._tips))
        self._solve({**self._tips, arm: tissue_from_tip})

    def release(self, arm: str) -> None:
        """``arm`` lets go; an arm that holds nothing stays as it is."""
        if arm not in self.holding:
            return
        self._model.release(arm)
        self._grips = [
            replace(grip, others={name: tip for name, tip in grip.others.items() if name != arm})
            for grip in self._grips
            if grip.arm != arm
        ]
        self._solve({name: tip for name, tip in self._tips.items() if name != arm})

    def track(self, setpoints: Mapping[str, Pose], time_s: float) -> TissueState:
        """Predict the tissue for the arms' setpoints (tissue_from_tip) at world time ``time_s``.

        Arms that hold nothing do not matter. Nothing is solved if no holding tip moved. Where the
        model cannot follow, the last good state comes back with ``converged`` False.

        Raises:
            ValueError: a holding arm has no setpoint, or it is not finite.
        """
        wanted = {arm: _finite(arm, setpoints) for arm in self.holding}
        if not np.isfinite(time_s):
            raise ValueError(f"time_s should be finite, is {time_s}")
        if not all(_same(wanted[arm], self._tips[arm]) for arm in wanted):
            self._solve(wanted)
        return self._state

    def set_attached(self, attached: Mask) -> TissueState:
        """Believe from now on that the holes ``attached`` (holes,) hold; keep the grasps.

        The present shape is led to the new equilibrium: at once, else through growing hole
        stiffness, else by repeating the motion since the grasps from the resting tissue. Where none
        of these finds an equilibrium the state is stale.
        """
        attached = np.asarray(attached, bool)
        before = self._scene.attached
        if attached.shape != before.shape:
            raise ValueError(f"attached should mark {before.size} holes, has {attached.shape}")
        self._scene = self._scene.with_attached(attached)
        start = self._model.snapshot()
        for lead in (self._at_once, self._ramp, self._repeat_motion):
            self._model.restore(start)
            if lead(before, attached):
                return self._solve(self._tips)
        self._model.restore(start)
        self._state = replace(self._state, converged=False)
        return self._state

    def _solve(self, tips: Mapping[str, Pose]) -> TissueState:
        self._tips = dict(tips)
        self._state = self._model.solve(self._tips)
        return self._state

    def _at_once(self, before: Mask, after: Mask) -> bool:
        self._model.set_hole_stiffness(self._scene.hole_stiffness_n_per_m(after))
        return self._model.solve(self._tips).converged

    def _ramp(self, before: Mask, after: Mask) -> bool:
        """Let the changed holes hold (or give way) little by little."""
        ramp_n_per_m = np.minimum(_RAMP_N_PER_M, self._scene.hold_n_per_m)
        for rising, falling in zip(ramp_n_per_m, ramp_n_per_m[::-1], strict=True):
            stiffness = self._scene.hole_stiffness_n_per_m(before & after)
            stiffness[after & ~before] = rising
            stiffness[before & ~after] = falling
            self._model.set_hole_stiffness(stiffness)
            if not self._model.solve(self._tips).converged:
                return False
        return self._at_once(before, after)

    def _repeat_motion(self, before: Mask, after: Mask) -> bool:
        """Start from the resting tissue and take every grasp again, in order."""
        self._model.set_hole_stiffness(self._scene.hole_stiffness_n_per_m(after))
        self._model.reset()
        for grip in self._grips:
            self._model.solve(grip.others)
            try:
                self._model.grasp(grip.arm, grip.tip)
            except NothingToGrasp:  # where a second arm took raised tissue that now lies lower
                return False
        return self._model.solve(self._tips).converged


def _finite(arm: str, setpoints: Mapping[str, Pose]) -> Pose:
    if arm not in setpoints:
        raise ValueError(f"{arm} holds tissue but has no setpoint; given: {sorted(setpoints)}")
    pose = setpoints[arm]
    if not (np.isfinite(pose.position_m).all() and np.isfinite(pose.rotation).all()):
        raise ValueError(f"the setpoint of {arm} is not finite: {pose.position_m}")
    return pose


def _same(one: Pose, other: Pose) -> bool:
    return bool(
        np.allclose(one.position_m, other.position_m, rtol=0, atol=1e-7)
        and np.allclose(one.rotation, other.rotation, rtol=0, atol=1e-6)
    )
