"""depth_bias: the depth camera measures too far or too near."""

from __future__ import annotations

from defras_sim.effects.camera_effect import CameraEffect
from defras_sim.effects.effect import EffectParameter, Values
from defras_sim.geometry import Floats


class DepthBias(CameraEffect):
    name = "depth_bias"
    sentence = "The depth camera reports scaled and shifted depths."
    parameters = (
        EffectParameter("scale", "1", 1.0, 0.8, 1.25, 0.01, "reported to true depth"),
        EffectParameter("offset_m", "m", 0.0, -0.03, 0.03, 0.002, "added to the scaled depth"),
    )
    falsified_by = "The residual along the optical axis does not depend on depth."
    excited_by = "Rest, and a pull towards the camera: both scale and offset need depth to vary."
    source = (
        "Ahn et al. 2019, Analysis and noise modeling of the Intel RealSense D435 for mobile "
        "robots (Ubiquitous Robots)"
    )

    def depth_m(self, values: Values, true_m: Floats) -> Floats:
        own = self.complete(values)
        return own["scale"] * true_m + own["offset_m"]

    def true_depth_m(self, values: Values, depth_m: Floats) -> Floats:
        own = self.complete(values)
        return (depth_m - own["offset_m"]) / own["scale"]


EFFECT = DepthBias()
