"""The tissue is held where the model is free."""

from __future__ import annotations

import numpy as np

from defras_sim.effects.disc import PLACE, Disc
from defras_sim.effects.effect import EffectParameter, Values
from defras_sim.effects.holding import by_holes, strengthened_by, strengthened_n_per_m
from defras_sim.effects.tissue_effect import Direction, Evolution, TissueEffect
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.tissue.model import TissueModel

STRENGTH = "share"


class ExtraAttachment(TissueEffect):
    """Holes of a disc have a share of the hold that they lack to a rigid attachment
    (:mod:`defras_sim.effects.holding`), from where the tissue rests."""

    name = "extra_attachment"
    sentence = "The tissue is held where the model is free."
    parameters = (
        EffectParameter(
            STRENGTH, "1", null=0.0, lower=0.0, upper=1.0, step=0.5,
            meaning="share of the hold that the holes of the disc gain; 1 is rigid",
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
    def __init__(self, disc: Disc, share: float, scene: Scene) -> None:
        self._disc, self._strength, self._xy_m = disc, share, scene.holes_xy_m
        self._is_hole = scene.is_hole.astype(float)
        self._share = self._is_hole * disc.share(self._xy_m)
        self._bare_n_per_m = np.zeros(len(self._xy_m))

    def hold_n_per_m(self, stiffness_n_per_m: Floats) -> Floats:
        self._bare_n_per_m = stiffness_n_per_m
        return strengthened_n_per_m(stiffness_n_per_m, self._strength * self._share)

    def directions(self) -> tuple[Direction, ...]:
        slope = self._is_hole * strengthened_by(self._bare_n_per_m, self._strength * self._share)
        if self._strength == 0.0:
            free_m = self._xy_m[(self._is_hole > 0) & (self._bare_n_per_m == 0)]
            if not len(free_m):
                return ()
            return tuple(
                Direction(STRENGTH, disc.place, by_holes(slope * disc.share(self._xy_m)))
                for disc in self._disc.elsewhere(free_m)
            )
        by = {STRENGTH: self._share}
        for name, each in self._disc.share_by(self._xy_m).items():
            by[name] = self._strength * each
        return tuple(Direction(name, {}, by_holes(slope * each)) for name, each in by.items())


EFFECT = ExtraAttachment()
