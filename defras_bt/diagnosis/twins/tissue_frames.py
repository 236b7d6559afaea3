"""What a model says about the frames of a trajectory."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from defras_bt.diagnosis.problem import Integers
from defras_bt.diagnosis.twins.tissue_trajectory import Trajectory
from defras_sim.effects.effect import Extension
from defras_sim.geometry import Floats, Pose
from defras_sim.prediction import predict
from defras_sim.scene import Scene
from defras_sim.surface import Surface


@dataclass(frozen=True)
class TissueFrames:
    """``surfaces`` of the frames as the camera saw them (None where the model could not follow).

    By arm: ``forces_n`` (f, 3) of the jaw on the tissue, NaN where the model could not follow, and
    ``tips_m`` (f, 3) as the encoders say. ``corrected`` brings points (n, 3) that the camera
    reports to where the model says that they truly are.
    """

    surfaces: tuple[Surface | None, ...]
    forces_n: Mapping[str, Floats]
    tips_m: Mapping[str, Floats]
    corrected: Callable[[Floats], Floats]


def frames_of(
    scene: Scene, model: Extension, trajectory: Trajectory, chosen: Integers | None = None
) -> TissueFrames:
    """The frames of ``trajectory``, or those ``chosen`` of them, as ``scene`` says that they are
    with the effects of ``model`` besides its own, or in their place.

    The tissue is solved at these only, and where a grip begins or ends.

    Raises:
        NothingToGrasp: a jaw takes tissue where the model has none.
        ValueError: no tissue can be as ``model`` says.
    """
    every = np.arange(len(trajectory.frames)) if chosen is None else chosen
    rows = trajectory.frames[every]
    found = predict(scene.extended({**scene.model.extension, **model}), trajectory.motion, rows)
    at = np.searchsorted(found.rows, rows)
    shown = [found.surface_shown(float(t)) for t in trajectory.motion.time_s[rows]]
    return TissueFrames(
        tuple(s if np.isfinite(s.vertices_m).all() else None for s in shown),
        {arm: found.force_n(arm)[at] for arm in trajectory.motion.arms},
        {arm: _positions(poses)[at] for arm, poses in found.measured.items()},
        found.camera.corrected,
    )


def _positions(poses: tuple[Pose, ...]) -> Floats:
    return np.array([pose.position_m for pose in poses])
