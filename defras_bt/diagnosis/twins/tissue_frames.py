"""What a model says about the frames of a trajectory."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from defras_bt.diagnosis.problem import Integers
from defras_bt.diagnosis.twins.tissue_trajectory import Trajectory
from defras_sim.effects import library
from defras_sim.effects.camera_layer import CameraLayer
from defras_sim.effects.effect import Extension, Values
from defras_sim.effects.layers import Layers
from defras_sim.effects.tissue_effect import NoSuchTissue
from defras_sim.geometry import Floats, Pose
from defras_sim.known_way import KnownWay
from defras_sim.prediction import Prediction, predict
from defras_sim.scene import Scene
from defras_sim.surface import Surface
from defras_sim.tissue.model import NothingToGrasp

_LOOKING = ("camera", "clock")
"""Layers that change how tissue is seen, and not where it is."""


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

    @property
    def largest_force_n(self) -> float:
        """Of any jaw in any frame that the model could follow."""
        forces = [np.linalg.norm(force, axis=1) for force in self.forces_n.values()]
        return float(max((np.nanmax(f, initial=0.0) for f in forces), default=0.0))


def before_the_camera(model: Extension) -> dict[str, Values]:
    """The effects of ``model`` that change what tissue and arms do, less those at null."""
    found = {}
    for name, values in model.items():
        effect = library.effect(name)
        if effect.layer not in _LOOKING and not effect.is_null(values):
            found[name] = values
    return found


def led_along(
    scene: Scene,
    model: Extension,
    trajectory: Trajectory,
    solved: Integers | None = None,
    like: KnownWay | None = None,
) -> Prediction | None:
    """What tissue and arms do along ``trajectory`` as ``scene`` says, with all effects of ``model``
    and none of the scene's; None where no tissue can be like that, or a jaw would take none.

    The tissue is solved at the instants ``solved``, where none are given at
    :attr:`Trajectory.solved`. Camera and clock are left out. ``like``: the way that a similar model
    went on the same mesh, which saves work.
    """
    rows = trajectory.solved if solved is None else solved
    try:
        plain = scene.extended(before_the_camera(model))
        return predict(plain, trajectory.motion, rows, trajectory.frames, like)
    except (NothingToGrasp, NoSuchTissue):
        return None


def frames_of(
    prediction: Prediction, scene: Scene, model: Extension, trajectory: Trajectory
) -> TissueFrames:
    """The frames of ``trajectory`` as the camera of ``scene`` shows what was predicted, with the
    effects of ``model`` on camera and clock."""
    layers = Layers.of(model)
    at = np.searchsorted(prediction.read, trajectory.frames)
    times = trajectory.time_s
    shown = [prediction.surface_shown(float(t) - layers.delay_s) for t in times]
    return TissueFrames(
        tuple(s if np.isfinite(s.vertices_m).all() else None for s in shown),
        {arm: prediction.force_between_n(arm, times) for arm in trajectory.motion.arms},
        {arm: _positions(poses)[at] for arm, poses in prediction.measured.items()},
        CameraLayer(scene.depth_camera, layers.camera).corrected,
    )


def _positions(poses: tuple[Pose, ...]) -> Floats:
    return np.array([pose.position_m for pose in poses])
