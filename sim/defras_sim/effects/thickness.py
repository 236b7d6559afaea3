"""The tissue is thicker or thinner than its model."""

from __future__ import annotations

from defras_sim.effects.effect import EffectParameter, Values
from defras_sim.effects.tissue_effect import Direction, Evolution, Steady, TissueEffect
from defras_sim.scene import Scene
from defras_sim.tissue.model import TissueModel
from defras_sim.tissue.parameters import AttachmentHeight, Parameter, TermParameter

SCALE = "scale"


class Thickness(TissueEffect):
    """The slab is ``scale`` times as thick; its upper face stays, bed and holes are where its lower
    face then is."""

    name = "thickness"
    sentence = "The tissue is thicker or thinner than its model."
    parameters = (
        EffectParameter(
            SCALE, "1", null=1.0, lower=0.2, upper=5.0, step=0.1,
            meaning="true thickness by the modelled one",
        ),
    )  # fmt: skip
    falsified_by = "Bending and stretching are modelled wrongly by the same factor."
    excited_by = "A fold beside a stretch: one grows with the cube of thickness, one with itself."
    source = "S. Timoshenko, S. Woinowsky-Krieger, Theory of Plates and Shells, 2nd ed., ch. 2."

    def scene(self, values: Values, scene: Scene) -> Scene:
        scale = values[SCALE]
        if scale == 1.0:
            return scene
        if scene.tissue.anatomy is not None:
            raise ValueError(
                "thickness: an anatomy is as thick as its scan says; only slabs can be rescaled"
            )
        thicker = {"thickness_m": scale * scene.tissue.thickness_m}
        return scene.model_copy(update={"tissue": scene.tissue.model_copy(update=thicker)})

    def begin(self, values: Values, model: TissueModel) -> Evolution:
        tissue = model.scene.tissue
        if tissue.anatomy is not None or tissue.gravity_m_s2 != 0.0:
            return Evolution()
        scale = values[SCALE]
        by: dict[Parameter, float] = {
            TermParameter("material", "thickness_scale"): 1 / scale,
            AttachmentHeight(): -tissue.thickness_m / scale,
        }
        if tissue.bed:
            by[TermParameter("bed", "height_m")] = -tissue.thickness_m / scale
        return Steady((Direction(SCALE, {}, by),))


EFFECT = Thickness()
