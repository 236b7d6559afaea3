"""The tissue is thicker or thinner than its model."""

from __future__ import annotations

from dataclasses import replace

from defras_sim.effects.effect import EffectParameter, Values
from defras_sim.effects.tissue_effect import (
    Direction,
    Evolution,
    Terms,
    TissueEffect,
    base_material,
)
from defras_sim.scene import Tissue
from defras_sim.tissue.loads import DeadLoad
from defras_sim.tissue.model import TissueModel
from defras_sim.tissue.parameters import (
    GRAVITY_M_S2,
    AttachmentHeight,
    Parameter,
    TermParameter,
)
from defras_sim.tissue.terms import Term

SCALE = "scale"


class Thickness(TissueEffect):
    """The tissue is ``scale`` times as thick: its upper face, which is seen, stays; bed and holes
    are so much lower.

    The dents of holes and jaws stay as they are: their depth goes with the power -0.3 of the
    thickness only.
    """

    name = "thickness"
    sentence = "The tissue is thicker or thinner than its model."
    parameters = (
        EffectParameter(
            SCALE, "1", null=1.0, lower=0.3, upper=3.0, step=0.1,
            meaning="true thickness by the modelled one",
        ),
    )  # fmt: skip
    falsified_by = "Bending and stretching are modelled wrongly by the same factor."
    excited_by = "A fold beside a stretch: one grows with the cube of thickness, one with itself."
    source = "S. Timoshenko, S. Woinowsky-Krieger, Theory of Plates and Shells, 2nd ed., ch. 2."

    def begin(self, values: Values, model: TissueModel) -> Evolution:
        return _Thicker(values[SCALE], model.scene.tissue)


class _Thicker(Evolution):
    def __init__(self, scale: float, tissue: Tissue) -> None:
        self._scale, self._modelled_m = scale, tissue.thickness_m
        self._weight_m_s2 = tissue.gravity_m_s2
        self._made_of: Term | None = None
        self._thicker: Terms = {}
        self._has_bed = False

    def terms(self, terms: Terms) -> Terms:
        self._has_bed = "bed" in terms
        if self._scale == 1.0:
            return terms
        if self._made_of is not terms["material"]:
            self._made_of, self._thicker = terms["material"], self._thickened(terms)
        return {**terms, **self._thicker}

    def lift_m(self) -> float:
        return (1 - self._scale) * self._modelled_m

    def directions(self) -> tuple[Direction, ...]:
        by: dict[Parameter, float] = {
            TermParameter("material", "thickness_scale"): 1 / self._scale,
            AttachmentHeight(): -self._modelled_m,
        }
        if self._has_bed:
            by[TermParameter("bed", "height_m")] = -self._modelled_m
        if self._weight_m_s2:
            by[GRAVITY_M_S2] = self._weight_m_s2 / self._scale
        return (Direction(SCALE, {}, by),)

    def _thickened(self, terms: Terms) -> Terms:
        body = base_material(terms)
        thicker: Terms = {body.name: body.with_points(body.points.thickened(self._scale))}
        gravity = terms.get("gravity")
        if isinstance(gravity, DeadLoad):
            weight = replace(gravity, forces_n=self._scale * gravity.forces_n)
            return {**thicker, "gravity": weight}
        return thicker


EFFECT = Thickness()
