"""The tissue is stiffer along one direction."""

from __future__ import annotations

import numpy as np

from defras_sim.effects.effect import EffectParameter, Values
from defras_sim.effects.tissue_effect import (
    Direction,
    Evolution,
    Terms,
    TissueEffect,
    base_material,
)
from defras_sim.tissue.assembly import ElasticBody
from defras_sim.tissue.fibres import Fibres, other_strength
from defras_sim.tissue.model import TissueModel
from defras_sim.tissue.parameters import TermParameter

STRENGTH, ANGLE = "strength", "angle_rad"
# Where there are no fibres yet, they are looked for along these.
ANGLES_RAD = tuple((np.pi / 6 * np.arange(6)).tolist())


class Anisotropy(TissueEffect):
    """A family of fibres in the tissue's plane, which carry tension: see
    :mod:`defras_sim.tissue.fibres`."""

    name = "anisotropy"
    rank = 1
    sentence = "The tissue is stiffer along one direction."
    parameters = (
        EffectParameter(
            STRENGTH, "1", null=0.0, lower=0.0, upper=100.0, step=0.5,
            meaning="by how many times its modulus the tissue is stiffer along the fibres",
        ),
        EffectParameter(
            ANGLE, "rad", null=0.0, lower=-np.pi, upper=np.pi, step=0.2, strength=False,
            meaning="of the fibres from x towards y; half a turn more is the same",
        ),
    )  # fmt: skip
    falsified_by = "Pulls along two directions across each other need the same force."
    excited_by = "Moving a lifted patch along x, then along y."
    source = "G. A. Holzapfel, T. C. Gasser, R. W. Ogden, Journal of Elasticity 61 (2000) 1-48."

    def begin(self, values: Values, model: TissueModel) -> Evolution:
        return _Fibrous(values[STRENGTH], values[ANGLE])


class _Fibrous(Evolution):
    def __init__(self, strength: float, angle_rad: float) -> None:
        self._strength, self._angle_rad = strength, angle_rad
        self._made_of: ElasticBody | None = None
        self._term: Fibres | None = None

    def terms(self, terms: Terms) -> Terms:
        body = base_material(terms)
        if self._term is None or self._made_of is not body:
            self._made_of = body
            fibres = Fibres(body.points, body.young_pa, self._strength, self._angle_rad)
            self._term = fibres if self._strength > 0 else fibres.with_others(ANGLES_RAD)
        return {**terms, self._term.name: self._term}

    def directions(self) -> tuple[Direction, ...]:
        if self._strength > 0:
            names = (STRENGTH, ANGLE)
            return tuple(Direction(n, {}, {TermParameter("anisotropy", n): 1.0}) for n in names)
        return tuple(
            Direction(
                STRENGTH,
                {ANGLE: angle},
                {TermParameter("anisotropy", other_strength(number)): 1.0},
            )
            for number, angle in enumerate(ANGLES_RAD)
        )


EFFECT = Anisotropy()
