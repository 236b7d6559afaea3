"""The tissue is stiffer or softer everywhere than its model."""

from __future__ import annotations

from dataclasses import replace

from defras_sim.effects.coupon_effect import CouponEffect, Pull
from defras_sim.effects.effect import EffectParameter, Values
from defras_sim.effects.tissue_effect import Direction, Evolution, Terms, TissueEffect
from defras_sim.scene import Scene
from defras_sim.tissue.material_points import MaterialTerm
from defras_sim.tissue.model import TissueModel
from defras_sim.tissue.parameters import YOUNG_MODULUS_SCALE, Parameter, TermParameter


class Stiffness(TissueEffect, CouponEffect):
    """Young's modulus is ``scale`` times the believed one, Poisson's ratio as believed."""

    name = "stiffness"
    twins = ("tissue", "coupon")
    sentence = "The tissue is stiffer or softer everywhere than its model."
    parameters = (
        EffectParameter(
            "scale", "1", null=1.0, lower=0.02, upper=50.0, step=0.1,
            meaning="true Young's modulus by the modelled one",
        ),
    )  # fmt: skip
    falsified_by = (
        "Forces of all motions and at all strains differ from the model's by other than one factor."
    )
    excited_by = (
        "Any pull with the force measured. Moved by displacements alone, without gravity, a "
        "uniform stiffness changes no shape, and only springs or weight beside it reveal it."
    )
    rank = 9
    source = "Linear scaling of a hyperelastic energy; Bonet and Wood, 2nd ed., ch. 6."

    coupon_stage = "elastic"

    def on_coupon(self, values: Values, pull: Pull) -> Pull:
        scale = self.complete(values)["scale"]
        return replace(pull, energy_j_m3=scale * pull.energy_j_m3, stress_pa=scale * pull.stress_pa)

    def scene(self, values: Values, scene: Scene) -> Scene:
        scale = values["scale"]
        if scale == 1.0:
            return scene
        modulus = {"young_modulus_pa": scale * scene.tissue.young_modulus_pa}
        return scene.model_copy(update={"tissue": scene.tissue.model_copy(update=modulus)})

    def begin(self, values: Values, model: TissueModel) -> Evolution:
        return _Scaled(values["scale"])


class _Scaled(Evolution):
    """Everything that the material does grows with its modulus, what it remembers included."""

    def __init__(self, scale: float) -> None:
        self._scale = scale
        self._names: tuple[str, ...] = ()

    def terms(self, terms: Terms) -> Terms:
        self._names = tuple(
            name
            for name, term in terms.items()
            if isinstance(term, MaterialTerm) and "stiffness_scale" in term.parameters
        )
        return terms

    def directions(self) -> tuple[Direction, ...]:
        by: dict[Parameter, float] = {YOUNG_MODULUS_SCALE: 1 / self._scale}
        for name in self._names:
            by[TermParameter(name, "stiffness_scale")] = 1 / self._scale
        return (Direction("scale", {}, by),)


EFFECT = Stiffness()
