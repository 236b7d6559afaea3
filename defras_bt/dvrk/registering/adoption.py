"""What a diagnosis found wrong with the registration, put into the registration.

Readings reach the twin through the registration, so the twin's ``tool_offset`` and
``camera_registration`` count from it: at zero, arms and camera stand as registered. What is found
of them later is by how much the registration was off, and belongs there rather than into a scene.
"""

from __future__ import annotations

from datetime import datetime

import numpy as np
from scipy.spatial.transform import Rotation

from defras_bt.dvrk.registering.registration import Registration
from defras_sim.effects import library
from defras_sim.effects.camera_effect import CameraEffect
from defras_sim.effects.effect import Extension, Values
from defras_sim.geometry import Pose
from defras_sim.scene import Scene

FOLDED = ("tool_offset", "camera_registration")
"""Effects that are nothing but errors of the registration."""


class NothingToAdopt(ValueError):
    """A scene adopts no effect that concerns the registration, or one that it has already."""


def adopted(registration: Registration, scene: Scene, measured: datetime) -> Registration:
    """``registration`` with what ``scene`` adopts of :data:`FOLDED`.

    Raises:
        NothingToAdopt: it adopts none of them, what one of them concerns is not registered, or
            the very same was adopted before.
    """
    extension: Extension = scene.model.extension
    found = [name for name in FOLDED if name in extension]
    if not found:
        raise NothingToAdopt(f"{scene.name} adopts neither {' nor '.join(FOLDED)}")
    for name in found:
        if dict(extension[name]) in registration.adopted.get(name, ()):
            raise NothingToAdopt(
                f"its {name} was adopted already: the registration stands where it says. What is "
                "wrong since, a new recording and defras diagnose tell"
            )
    if "tool_offset" in extension and not registration.arms:
        raise NothingToAdopt("its tool_offset concerns the arms, of which none is registered")
    if "camera_registration" in extension and "depth" not in registration.cameras:
        raise NothingToAdopt(
            "its camera_registration concerns the depth camera, which is not registered"
        )
    if "tool_offset" in extension:
        true_from_believed = _tool_offset(extension["tool_offset"])
        for name, placed in registration.arms.items():
            moved = placed.moved_to(true_from_believed @ placed.pose)
            registration = registration.with_arm(name, moved, measured)
    if "camera_registration" in extension:
        effect = library.effect("camera_registration")
        assert isinstance(effect, CameraEffect)
        reported = effect.placement(extension["camera_registration"], scene.depth_camera)
        depth = registration.cameras["depth"]
        moved = depth.moved_to(reported.inverse() @ depth.pose)
        registration = registration.with_camera("depth", moved, measured)
    for name in found:
        registration = registration.with_adopted(name, extension[name])
    return registration


def without_adopted(scene: Scene) -> Scene:
    """``scene`` for use with the registration that took its effects over."""
    kept = {name: v for name, v in scene.model.extension.items() if name not in FOLDED}
    return scene.extended(kept)


def _tool_offset(values: Values) -> Pose:
    """Where a tip truly is that is believed to be at a place, both in the tissue frame."""
    own = library.effect("tool_offset").complete(values)
    shift_m = np.array([own[f"{axis}_m"] for axis in "xyz"])
    turn = Rotation.from_rotvec([own[f"turn_{axis}_rad"] for axis in "xyz"]).as_matrix()
    return Pose(shift_m, turn)
