"""The tissue sticks to its bed until it is pulled off."""

from __future__ import annotations

import numpy as np

from defras_sim.effects.effect import EffectParameter, Values
from defras_sim.effects.tissue_effect import Direction, Evolution, Terms, TissueEffect
from defras_sim.geometry import Floats
from defras_sim.tissue.adhesion import Adhesion
from defras_sim.tissue.model import TissueModel
from defras_sim.tissue.parameters import TermParameter
from defras_sim.tissue.state import TissueState

STRENGTH, REACH = "strength_pa", "reach_m"


class BedAdhesion(TissueEffect):
    """A cohesive zone under the whole lower face: see :mod:`defras_sim.tissue.adhesion`."""

    name = "bed_adhesion"
    sentence = "The tissue sticks to its bed until it is pulled off."
    parameters = (
        EffectParameter(
            STRENGTH, "Pa", null=0.0, lower=0.0, upper=5000.0, step=20.0,
            meaning="largest traction with which the bed holds the tissue back",
        ),
        EffectParameter(
            REACH, "m", null=0.001, lower=0.0002, upper=0.01, step=0.0005, strength=False,
            meaning="how far from the bed the traction is largest",
        ),
    )  # fmt: skip
    falsified_by = "A second lift needs the force of the first, or the tissue peels off nowhere."
    excited_by = "A slow lift away from the bed, then the same lift again."
    source = "A. Needleman, Journal of Applied Mechanics 54 (1987) 525-531."

    def begin(self, values: Values, model: TissueModel) -> Evolution:
        lower = model.scene.tissue.shape.lower
        adhesion = Adhesion.of(model.mesh, lower, model.rest_m, values[STRENGTH], values[REACH])
        return _Sticking(adhesion, model)


class _Sticking(Evolution):
    memory: Floats
    """How far each point has been from where it stuck."""

    def __init__(self, adhesion: Adhesion, model: TissueModel) -> None:
        self._term = adhesion
        self._model = model
        self.memory = adhesion.farthest_m

    def terms(self, terms: Terms) -> Terms:
        if self._term.farthest_m is not self.memory:
            self._term = self._term.with_farthest(self.memory)
        return {**terms, self._term.name: self._term}

    def after(self, time_s: float, state: TissueState) -> bool:
        placed = self._model.terms[self._term.name]  # on a bed that breathes, another
        assert isinstance(placed, Adhesion)
        farthest = np.maximum(self.memory, placed.away_m(state.nodes_m))
        if not np.array_equal(farthest, self.memory):
            self.memory = farthest
        return False

    def directions(self) -> tuple[Direction, ...]:
        if self._term.strength_pa > 0.0:
            # How far the tissue peels matters most by then, and that is in the past.
            return ()
        reach = {REACH: self._term.reach_m}
        return (Direction(STRENGTH, reach, {TermParameter("bed_adhesion", STRENGTH): 1.0}),)


EFFECT = BedAdhesion()
