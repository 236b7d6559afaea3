"""camera_latency: the depth camera's clouds are older than their stamps say."""

from __future__ import annotations

from defras_sim.effects.clock_effect import ClockEffect
from defras_sim.effects.effect import EffectParameter, Values


class CameraLatency(ClockEffect):
    name = "camera_latency"
    sentence = "The depth camera's clouds show the tissue as it was a while before their stamps."
    parameters = (
        EffectParameter("delay_s", "s", 0.0, 0.0, 1.0, 0.05, "age of a cloud at its stamp"),
    )
    falsified_by = "The residual does not change with the speed of the tip."
    excited_by = "Going to and fro at constant speed: the residual changes sign with the direction."
    source = (
        "Furgale, Rehder and Siegwart 2013, Unified temporal and spatial calibration for "
        "multi-sensor systems (IROS)"
    )

    def delay_s(self, values: Values) -> float:
        return self.complete(values)["delay_s"]


EFFECT = CameraLatency()
