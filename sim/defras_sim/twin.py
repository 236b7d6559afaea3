"""Twin: predicts what the sensors should say from the commanded motion and the believed scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from defras_sim.effects.camera_layer import CameraLayer
from defras_sim.effects.camera_registration import EFFECT as REGISTRATION
from defras_sim.effects.extended_tissue import ExtendedTissue
from defras_sim.effects.layers import Layers
from defras_sim.geometry import Floats, Pose
from defras_sim.held_motion import HeldMotion
from defras_sim.scene import RIGID_HOLE_N_PER_M, ModelExtension, Scene
from defras_sim.tissue.model import NothingToGrasp
from defras_sim.tissue.state import TissueState
from defras_sim.worlds.protocol import PointCloud

Mask = NDArray[np.bool_]

# Stiffnesses through which a hole that starts (or stops) to hold is led: the tissue under a hole
# gives way near 40 N/m, so most of the change of shape happens between 1 and 1000 N/m.
_RAMP_N_PER_M = np.array([1.0, 4.0, 10.0, 25.0, 60.0, 150.0, 500.0, RIGID_HOLE_N_PER_M])
# Tissue gives way a hundred times as far as an arm: two rounds find where both come to rest.
_GIVING_ROUNDS = 3


@dataclass(frozen=True)
class _Grip:
    """An arm that holds: where its jaw closed, and where the others held at that time."""

    arm: str
    jaw: Pose
    others: Mapping[str, Pose]


class Twin:
    """The believed tissue, led along by the arms' setpoints, and the camera that looks at it.

    Commanded motion goes through the layers arm, grasp and tissue, each changed by those effects
    of ``scene.model`` that act on it; clouds are led back through camera and clock.

    Example:
        >>> twin = Twin(scene)
        >>> twin.grasp("psm1", setpoints["psm1"], time_s)
        >>> state = twin.track(setpoints, time_s)
        >>> state.surface, twin.force_n, twin.corrected(cloud)
    """

    def __init__(self, scene: Scene, *, start_s: float = 0.0) -> None:
        """The tissue has been at rest until world time ``start_s``.

        Raises:
            ValueError: the scene adopts what no tissue can have.
        """
        layers = Layers.of(scene.model.extension)
        self._scene = scene
        self._motion = HeldMotion(scene, layers)
        self._tissue = ExtendedTissue(scene, layers.tissue)
        self._camera = CameraLayer(scene.depth_camera, layers.camera)
        self._delay_s = layers.delay_s
        self._time_s = start_s
        self._grips: list[_Grip] = []
        self._jaws: dict[str, Pose] = {}
        """Where held patches were last asked to be; not reached while the state is stale."""
        self._state = self._tissue.solve({}, self._time_s)

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
    def taken(self) -> Mapping[str, Pose]:
        """tissue_from_jaw by holding arm: where it really took the tissue."""
        return {grip.arm: grip.jaw for grip in self._grips}

    @property
    def jaws(self) -> Mapping[str, Pose]:
        """tissue_from_jaw by holding arm: where what it holds was carried last. Without effects on
        arms and grasps that is its set-point."""
        return dict(self._jaws)

    @property
    def force_n(self) -> float:
        """Largest force of a grasp on the tissue; 0 without a grasp, NaN while stale."""
        if not self._state.converged:
            return float("nan")
        forces = self._state.grasp_forces_n.values()
        return max((float(np.linalg.norm(force)) for force in forces), default=0.0)

    def grasp(self, arm: str, tissue_from_tip: Pose, time_s: float | None = None) -> None:
        """``arm`` takes the tissue with its set-point at the pose, at world time ``time_s`` (that
        of the last call where none is given).

        Raises:
            ValueError: the arm holds already, its set-point is not finite, or its tip is not on
                the believed tissue.
        """
        if arm in self.holding:
            raise ValueError(f"{arm} holds tissue already; release it first")
        self._reach(time_s)
        self._motion.follow({arm: _finite(arm, {arm: tissue_from_tip})}, self._time_s)
        jaw = self._motion.take(arm, self._time_s)
        try:
            self._tissue.grasp(arm, jaw)
        except NothingToGrasp:
            self._motion.let_go(arm)
            raise
        self._grips.append(_Grip(arm, jaw, self._jaws))
        self._solve({**self._jaws, arm: jaw})

    def release(self, arm: str, time_s: float | None = None) -> None:
        """``arm`` lets go; an arm that holds nothing stays as it is."""
        if arm not in self.holding:
            return
        self._reach(time_s)
        self._tissue.release(arm)
        self._motion.let_go(arm)
        self._grips = [
            replace(grip, others={name: jaw for name, jaw in grip.others.items() if name != arm})
            for grip in self._grips
            if grip.arm != arm
        ]
        self._solve({name: jaw for name, jaw in self._jaws.items() if name != arm})

    def follow(self, setpoints: Mapping[str, Pose], time_s: float) -> None:
        """The arms are told to be at ``setpoints`` at ``time_s``; the tissue is not asked yet."""
        self._reach(time_s)
        self._motion.follow(
            {arm: pose for arm, pose in setpoints.items() if _is_finite(pose)}, self._time_s
        )

    def track(
        self, setpoints: Mapping[str, Pose], time_s: float, change_m: Floats | None = None
    ) -> TissueState:
        """Predict the tissue for the arms' setpoints (tissue_from_tip) at world time ``time_s``.

        Nothing is solved if no held patch moved and the tissue is none that changes with time.
        Where the model cannot follow, the last good state comes back with ``converged`` False.
        ``change_m`` (nodes, 3): about how far the nodes go, where that is known; it saves work.

        Raises:
            ValueError: a holding arm has no setpoint, or it is not finite.
        """
        for arm in self.holding:
            _finite(arm, setpoints)
        if not np.isfinite(time_s):
            raise ValueError(f"time_s should be finite, is {time_s}")
        self.follow(setpoints, time_s)
        due = self._tissue.is_due(self._time_s)
        for _ in range(_GIVING_ROUNDS):
            wanted = self._motion.held(self._time_s, self._state.grasp_forces_n)
            if not due and all(_same(wanted[arm], self._jaws[arm]) for arm in wanted):
                break
            self._solve(wanted, change_m)
            due, change_m = False, None
            if not self._motion.gives or not self._state.converged:
                break
        return self._state

    def corrected(self, cloud: PointCloud) -> PointCloud:
        """What the camera would have reported if it were as the scene says: points (n, 3) where
        they truly were, stamped when they truly were there."""
        if self._camera.is_plain and self._delay_s == 0.0:
            return cloud
        points_m = self._camera.corrected(cloud.points_m)
        return PointCloud(cloud.stamp_s - self._delay_s, points_m)

    def measured(self, arm: str) -> Pose:
        """tissue_from_tip that the encoders of ``arm`` should say at the last set-point."""
        return self._motion.measured(arm)

    def register_camera(self, true_from_reported: Pose) -> None:
        """Believe that points as :meth:`corrected` gives them until now lie moved by the pose.

        The scene adopts it as ``camera_registration``; a depth bias that it has beside that stays
        as it is, which to first order changes nothing.

        Raises:
            ValueError: no camera is off so far.
        """
        camera, known = self._scene.depth_camera, self._scene.model.extension
        placed = REGISTRATION.placement(known.get(REGISTRATION.name, {}), camera)
        values = REGISTRATION.values_of(placed @ true_from_reported.inverse(), camera)
        model = ModelExtension.of({**known, REGISTRATION.name: values})
        self._scene = self._scene.model_copy(update={"model": model})
        self._camera = CameraLayer(camera, Layers.of(model.extension).camera)

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
        start = self._tissue.snapshot()
        for lead in (self._at_once, self._ramp, self._repeat_motion):
            self._tissue.restore(start)
            if lead(before, attached):
                return self._solve(self._jaws)
        self._tissue.restore(start)
        self._state = replace(self._state, converged=False)
        return self._state

    def _reach(self, time_s: float | None) -> None:
        """World time is ``time_s`` now; a tissue with a memory cannot go back."""
        if time_s is not None:
            self._time_s = max(self._time_s, time_s)

    def _solve(self, jaws: Mapping[str, Pose], change_m: Floats | None = None) -> TissueState:
        self._jaws = dict(jaws)
        self._state = self._tissue.solve(self._jaws, self._time_s, change_m)
        return self._state

    def _at_once(self, before: Mask, after: Mask) -> bool:
        self._tissue.set_hole_stiffness(self._scene.hole_stiffness_n_per_m(after))
        return self._tissue.solve(self._jaws, self._time_s).converged

    def _ramp(self, before: Mask, after: Mask) -> bool:
        """Let the changed holes hold (or give way) little by little."""
        ramp_n_per_m = np.minimum(_RAMP_N_PER_M, self._scene.hold_n_per_m)
        for rising, falling in zip(ramp_n_per_m, ramp_n_per_m[::-1], strict=True):
            stiffness = self._scene.hole_stiffness_n_per_m(before & after)
            stiffness[after & ~before] = rising
            stiffness[before & ~after] = falling
            self._tissue.set_hole_stiffness(stiffness)
            if not self._tissue.solve(self._jaws, self._time_s).converged:
                return False
        return self._at_once(before, after)

    def _repeat_motion(self, before: Mask, after: Mask) -> bool:
        """Start from the resting tissue and take every grasp again, in order."""
        self._tissue.set_hole_stiffness(self._scene.hole_stiffness_n_per_m(after))
        self._tissue.reset()
        for grip in self._grips:
            self._tissue.solve(grip.others, self._time_s)
            try:
                self._tissue.grasp(grip.arm, grip.jaw)
            except NothingToGrasp:  # where a second arm took raised tissue that now lies lower
                return False
        return self._tissue.solve(self._jaws, self._time_s).converged


def _finite(arm: str, setpoints: Mapping[str, Pose]) -> Pose:
    if arm not in setpoints:
        raise ValueError(f"{arm} holds tissue but has no setpoint; given: {sorted(setpoints)}")
    pose = setpoints[arm]
    if not _is_finite(pose):
        raise ValueError(f"the setpoint of {arm} is not finite: {pose.position_m}")
    return pose


def _is_finite(pose: Pose) -> bool:
    return bool(np.isfinite(pose.position_m).all() and np.isfinite(pose.rotation).all())


def _same(one: Pose, other: Pose) -> bool:
    return bool(
        np.allclose(one.position_m, other.position_m, rtol=0, atol=1e-7)
        and np.allclose(one.rotation, other.rotation, rtol=0, atol=1e-6)
    )
