"""Attachments let go during the motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defras_sim.effects.disc import PLACE, Disc
from defras_sim.effects.effect import EffectParameter, Values
from defras_sim.effects.holding import by_holes, weakened_by, weakened_n_per_m
from defras_sim.effects.tissue_effect import Direction, Evolution, TissueEffect
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.tissue.model import TissueModel
from defras_sim.tissue.state import TissueState

STRENGTH, TIME, FORCE = "share", "time_s", "force_n"


class AttachmentTear(TissueEffect):
    """From ``time_s`` on, each attachment of a disc that carries ``force_n`` or more loses a share
    of its hold (see :mod:`defras_sim.effects.holding`), and never gets it back."""

    name = "attachment_tear"
    rank = 3
    sentence = "Attachments let go during the motion."
    parameters = (
        EffectParameter(
            STRENGTH, "1", null=0.0, lower=0.0, upper=1.0, step=0.5,
            meaning="share of the hold that torn attachments lack; 1 is free",
        ),
        *PLACE,
        EffectParameter(
            TIME, "s", null=0.0, lower=0.0, upper=1e5, step=1.0, strength=False,
            meaning="world time before which nothing tears",
        ),
        EffectParameter(
            FORCE, "N", null=0.0, lower=0.0, upper=10.0, step=0.02, strength=False,
            meaning="force of one attachment on the tissue below which it does not tear",
        ),
    )  # fmt: skip
    falsified_by = "Tissue and force do not jump, and a pull repeated gives what it gave."
    excited_by = "A pull that loads the suspected attachments, then the same pull again."
    source = "Brittle failure: no healing, no creep."
    special_cases = ("missing_attachment",)  # torn before anything moved

    def begin(self, values: Values, model: TissueModel) -> Evolution:
        return _Tearing(values, model.scene)


@dataclass(frozen=True)
class _Past:
    """Which holes (holes,) would have torn were they in the disc, and what each carried last."""

    torn: NDArray[np.bool_]
    carried_n: Floats


class _Tearing(Evolution):
    memory: _Past

    def __init__(self, values: Values, scene: Scene) -> None:
        self._lost, self._from_s, self._force_n = values[STRENGTH], values[TIME], values[FORCE]
        self._disc = Disc.of(values, scene.attachments.hole_pitch_m)
        self._xy_m = scene.holes_xy_m
        self._share = self._disc.share(self._xy_m)
        holes = len(self._xy_m)
        self.memory = _Past(np.zeros(holes, dtype=bool), np.zeros(holes))
        self._torn = self.memory.torn
        """By now: as remembered, and what tears because its time has come."""
        self._whole_n_per_m = np.zeros(holes)

    def before(self, time_s: float) -> bool:
        overloaded = self.memory.carried_n >= self._force_n
        self._torn = self.memory.torn | (overloaded & (time_s >= self._from_s))
        new = self._torn & ~self.memory.torn
        return self._lost > 0 and bool(np.any(new & (self._share > 0)))

    def hold_n_per_m(self, stiffness_n_per_m: Floats) -> Floats:
        self._whole_n_per_m = stiffness_n_per_m
        return weakened_n_per_m(stiffness_n_per_m, self._lost * self._share * self._torn)

    def after(self, time_s: float, state: TissueState) -> bool:
        carried = np.linalg.norm(state.attachment_forces_n, axis=1)
        self.memory = _Past(self._torn, carried)
        return self.before(time_s)

    def directions(self) -> tuple[Direction, ...]:
        slope = weakened_by(self._whole_n_per_m, self._lost * self._share * self._torn)
        slope = slope * self._torn
        if self._lost == 0.0:
            when = {TIME: self._from_s, FORCE: self._force_n}
            held_m = self._xy_m[self._whole_n_per_m > 0]
            discs = self._disc.elsewhere(held_m) if len(held_m) else ()
            return tuple(
                Direction(STRENGTH, disc.place | when, by_holes(slope * disc.share(self._xy_m)))
                for disc in discs
            )
        by = {STRENGTH: self._share}
        for name, each in self._disc.share_by(self._xy_m).items():
            by[name] = self._lost * each
        return tuple(Direction(name, {}, by_holes(slope * each)) for name, each in by.items())


EFFECT = AttachmentTear()
