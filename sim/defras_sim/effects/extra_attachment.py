"""The tissue is held where the model is free."""

from __future__ import annotations

import numpy as np

from defras_sim.effects.disc import PLACE, Disc
from defras_sim.effects.effect import EffectParameter, Values
from defras_sim.effects.holding import by_holes
from defras_sim.effects.tissue_effect import Direction, Evolution, TissueEffect
from defras_sim.geometry import Floats
from defras_sim.scene import RIGID_HOLE_N_PER_M, Scene
from defras_sim.tissue.model import TissueModel

STRENGTH = "stiffness_n_per_m"


class ExtraAttachment(TissueEffect):
    """Holes of a disc hold the tissue at least so firmly, from where it rests."""

    name = "extra_attachment"
    sentence = "The tissue is held where the model is free."
    parameters = (
        EffectParameter(
            STRENGTH, "N/m", null=0.0, lower=0.0, upper=RIGID_HOLE_N_PER_M, step=40.0,
            meaning="stiffness of each hole of the disc; above 1000 it is as good as rigid",
        ),
        *PLACE,
    )  # fmt: skip
    falsified_by = "The tissue over the disc comes along as far as modelled when it is lifted."
    excited_by = "A lift beside the disc; nothing shows before the tissue over it would move."
    source = "Tagliabue et al. (2022), attachment points as boundary conditions."

    def begin(self, values: Values, model: TissueModel) -> Evolution:
        rim_m = model.scene.attachments.hole_pitch_m
        return _Held(Disc.of(values, rim_m), values[STRENGTH], model.scene)


class _Held(Evolution):
    def __init__(self, disc: Disc, stiffness_n_per_m: float, scene: Scene) -> None:
        self._disc, self._strength = disc, stiffness_n_per_m
        self._xy_m, self._is_hole = scene.holes_xy_m, scene.is_hole
        self._share = np.where(self._is_hole, disc.share(self._xy_m), 0.0)
        self._acts = np.ones(len(self._xy_m), dtype=bool)
        """Where holes hold no more firmly without the effect."""

    def hold_n_per_m(self, stiffness_n_per_m: Floats) -> Floats:
        extra = self._strength * self._share
        self._acts = self._is_hole & (stiffness_n_per_m <= extra)
        return np.maximum(stiffness_n_per_m, extra)

    def directions(self) -> tuple[Direction, ...]:
        acts = self._acts.astype(float)
        if self._strength == 0.0:
            free_m = self._xy_m[self._acts]
            if not len(free_m):
                return ()
            return tuple(
                Direction(STRENGTH, disc.place, by_holes(acts * disc.share(self._xy_m)))
                for disc in self._disc.elsewhere(free_m)
            )
        by = {STRENGTH: self._share}
        for name, slope in self._disc.share_by(self._xy_m).items():
            by[name] = self._strength * slope
        return tuple(Direction(name, {}, by_holes(acts * each)) for name, each in by.items())


EFFECT = ExtraAttachment()
