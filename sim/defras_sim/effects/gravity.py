"""The tissue is heavier than its model."""

from __future__ import annotations

from defras_sim.effects.effect import EffectParameter, Values
from defras_sim.effects.tissue_effect import NoSuchTissue, TissueEffect
from defras_sim.scene import Scene

ACCELERATION = "acceleration_m_s2"


class Gravity(TissueEffect):
    """Gravity along -z beside what the scene has; attachments grew where the tissue then lies.

    No direction: where tissue that floated comes to lie on its bed has no derivative.
    """

    name = "gravity"
    sentence = "The tissue is heavier than its model."
    parameters = (
        EffectParameter(
            ACCELERATION, "m/s^2", null=0.0, lower=-20.0, upper=20.0, step=1.0,
            meaning="what is to be added to the modelled acceleration of gravity",
        ),
    )  # fmt: skip
    falsified_by = "Lifted tissue does not sag between the jaw and its attachments."
    excited_by = "A lift as high as the force allows: the force grows with the tissue lifted."
    source = "Dead load of a density; Bonet and Wood, 2nd ed., section 9.2."

    def scene(self, values: Values, scene: Scene) -> Scene:
        added = values[ACCELERATION]
        if added == 0.0:
            return scene
        total = scene.tissue.gravity_m_s2 + added
        if total < 0:
            raise NoSuchTissue(
                f"gravity: {ACCELERATION} of {added:g} would make the scene's "
                f"{scene.tissue.gravity_m_s2:g} m/s^2 negative; at least "
                f"{-scene.tissue.gravity_m_s2:g}"
            )
        if not scene.tissue.bed:
            raise NoSuchTissue("gravity: tissue without a bed has nothing to lie on (tissue.bed)")
        tissue = scene.tissue.model_copy(update={"gravity_m_s2": total})
        return scene.model_copy(update={"tissue": tissue})


EFFECT = Gravity()
