"""camera_registration: the depth camera does not stand where the scene says."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from defras_sim.effects.camera_effect import CameraEffect
from defras_sim.effects.effect import EffectParameter, Values
from defras_sim.geometry import Pose
from defras_sim.scene import Camera

_AXES = "xyz"


class CameraRegistration(CameraEffect):
    """Everything the camera reports is displaced rigidly. It turns about the point that the camera
    looks at, so that turning and shifting show differently on the tissue."""

    name = "camera_registration"
    sentence = "The depth camera does not stand where the scene says; its cloud is displaced."
    parameters = (
        *(
            EffectParameter(f"{a}_m", "m", 0.0, -0.05, 0.05, 0.002, f"shift of the cloud along {a}")
            for a in _AXES
        ),
        *(
            EffectParameter(f"turn_{a}_rad", "rad", 0.0, -0.3, 0.3, 0.02, f"its turn about {a}")
            for a in _AXES
        ),
    )
    falsified_by = "At rest, before anything is grasped, the cloud lies on the tissue."
    excited_by = "None is needed: the tissue at rest shows it, its rim above all."
    source = (
        "Ozguner et al. 2020, Camera-robot calibration for the da Vinci robotic surgery system "
        "(IEEE Transactions on Automation Science and Engineering)"
    )

    def placement(self, values: Values, camera: Camera) -> Pose:
        own = self.complete(values)
        shift_m = np.array([own[f"{a}_m"] for a in _AXES])
        turn = Rotation.from_rotvec([own[f"turn_{a}_rad"] for a in _AXES]).as_matrix()
        pivot_m = np.array(camera.target_m)
        return Pose(pivot_m + shift_m - turn @ pivot_m, turn)

    def values_of(self, placement: Pose, camera: Camera) -> dict[str, float]:
        """The parameters whose :meth:`placement` is ``placement`` (reported_from_true).

        Raises:
            ValueError: it is farther than any camera is off.
        """
        pivot_m = np.array(camera.target_m)
        shift_m = placement.apply(pivot_m) - pivot_m
        turn_rad = Rotation.from_matrix(placement.rotation).as_rotvec()
        values = {f"{a}_m": float(shift_m[i]) for i, a in enumerate(_AXES)}
        values |= {f"turn_{a}_rad": float(turn_rad[i]) for i, a in enumerate(_AXES)}
        return self.complete(values)


EFFECT = CameraRegistration()
