"""A tissue model with effects: built with them, and led along with their history."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from defras_sim.effects import library
from defras_sim.effects.effect import Extension
from defras_sim.effects.tissue_effect import Direction, Evolution, Memory, TissueEffect
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Scene
from defras_sim.tissue.holes import TERM_NAME as ATTACHMENTS
from defras_sim.tissue.model import TissueModel, TissueSnapshot
from defras_sim.tissue.parameters import TermParameter
from defras_sim.tissue.state import TissueState
from defras_sim.tissue.terms import OnBed, Term
from defras_sim.tissue.travel import Tips

# What tears loads its neighbours, which may then tear. A chain as long as this runs away.
MOST_TEARS = 40


@dataclass(frozen=True)
class ExtendedSnapshot:
    """Everything an :class:`ExtendedTissue` needs to go on from here."""

    tissue: TissueSnapshot
    memories: Mapping[str, Memory]


class ExtendedTissue:
    """The tissue of a scene with those effects of ``extension`` that act on tissue.

    Without any it is the plain :class:`TissueModel`, bit by bit. ``model`` is for reading; what
    changes it goes through here.

    Example:
        >>> tissue = ExtendedTissue(scene, {"stress_relaxation": {"fraction": 0.3, "time_s": 2.0}})
        >>> tissue.grasp("psm1", tip)
        >>> state = tissue.solve({"psm1": tip}, time_s=0.0)
    """

    def __init__(self, scene: Scene, extension: Extension, **options: Any) -> None:
        """``options`` are those of :class:`TissueModel`.

        Raises:
            ValueError: an effect or a parameter is unknown or out of bounds, or no such tissue can
                be.
        """
        chosen = [(library.effect(name), values) for name, values in extension.items()]
        effects = [(e, e.complete(v)) for e, v in chosen if isinstance(e, TissueEffect)]
        effects.sort(key=lambda each: (each[0].rank, each[0].name))
        for effect, values in effects:
            scene = effect.scene(values, scene)
        self.scene = scene
        self.model = TissueModel(scene, **options)
        self._believed_n_per_m = self.model.hole_stiffness_n_per_m
        self._plain = {name: t for name, t in self.model.terms.items() if name != ATTACHMENTS}
        self._placed: Mapping[str, Term] = self._plain
        self._on_bed: dict[str, tuple[Term, float, Term]] = {}
        """By name: a term, by how much it was raised, and what that gave."""
        self._evolutions: dict[str, Evolution] = {
            effect.name: effect.begin(values, self.model) for effect, values in effects
        }
        self._put()

    def set_hole_stiffness(self, stiffness_n_per_m: Floats) -> None:
        """What the holes (holes,) would hold with if there were no effects.

        Raises:
            ValueError: wrong count, negative, or not finite.
        """
        stiffness = np.array(stiffness_n_per_m, dtype=float)
        self.model.set_hole_stiffness(self._held_n_per_m(stiffness))
        self._believed_n_per_m = stiffness

    def is_due(self, time_s: float) -> bool:
        """Whether the tissue is another at ``time_s`` than it was last, though no tip moves."""
        due = [each.before(time_s) for each in self._evolutions.values()]
        return any(due)

    def solve(self, tips: Tips, time_s: float, change_m: Floats | None = None) -> TissueState:
        """Equilibrium at world time ``time_s``; see :meth:`TissueModel.solve`.

        Where the tissue tears and finds no rest afterwards, the state is stale.
        """
        if not self._evolutions:
            return self.model.solve(tips, change_m)
        iterations = 0
        for _ in range(MOST_TEARS):
            self.is_due(time_s)
            self._put()
            state = self.model.solve(tips, change_m)
            change_m = None
            iterations += state.iterations
            if not state.converged:
                break
            torn = [each.after(time_s, state) for each in self._evolutions.values()]
            if not any(torn):
                break
        else:
            state = replace(state, converged=False)
        return replace(state, iterations=iterations)

    def _put(self) -> None:
        """Make the model what the effects make of it now."""
        terms: Mapping[str, Term] = self._plain
        for each in self._evolutions.values():
            terms = each.terms(terms)
        height_m = sum(each.lift_m() for each in self._evolutions.values())
        terms = {name: self._raised(term, height_m) for name, term in terms.items()}
        for name in self._placed.keys() - terms.keys():
            self.model.remove_term(name)
        for name, term in terms.items():
            if self._placed.get(name) is not term:
                self.model.set_term(term)
        self._placed = terms
        held = self._held_n_per_m(self._believed_n_per_m)
        if not np.array_equal(held, self.model.hole_stiffness_n_per_m):
            self.model.set_hole_stiffness(held)
        self.model.lift_attachments(height_m)
        self.model.scale_dents(math.prod(each.dent_factor() for each in self._evolutions.values()))

    def _raised(self, term: Term, height_m: float) -> Term:
        """``term`` on a bed so much higher; the same object as long as nothing changes."""
        if not isinstance(term, OnBed):
            return term
        known = self._on_bed.get(term.name)
        if known is None or known[0] is not term or known[1] != height_m:
            raised = term.raised(height_m) if height_m != 0.0 else term
            known = self._on_bed[term.name] = term, height_m, raised
        return known[2]

    def _held_n_per_m(self, stiffness_n_per_m: Floats) -> Floats:
        for each in self._evolutions.values():
            stiffness_n_per_m = each.hold_n_per_m(stiffness_n_per_m)
        return stiffness_n_per_m

    def directions(self, effect: str) -> tuple[Direction, ...]:
        """Derivatives by the parameters of ``effect``, which must be one of the extension.

        None that another effect hides: within a softened material, its parts have none. What the
        tissue has been through is taken as it was.
        """
        terms = self.model.terms
        return tuple(
            direction
            for direction in self._evolutions[effect].directions()
            if all(
                p.term in terms and p.parameter in terms[p.term].parameters
                for p in direction.by
                if isinstance(p, TermParameter)
            )
        )

    def grasp(self, arm: str, tissue_from_tip: Pose) -> None:
        """See :meth:`TissueModel.grasp`."""
        self.model.grasp(arm, tissue_from_tip)

    def release(self, arm: str) -> None:
        """See :meth:`TissueModel.release`."""
        self.model.release(arm)

    def reset(self) -> None:
        """Nothing grasped, as at rest; what the tissue has been through stays."""
        self.model.reset()

    def snapshot(self) -> ExtendedSnapshot:
        memories = {name: each.memory for name, each in self._evolutions.items()}
        return ExtendedSnapshot(self.model.snapshot(), memories)

    def restore(self, snapshot: ExtendedSnapshot) -> None:
        """Go back to ``snapshot``; holes stay as they are believed now."""
        for name, memory in snapshot.memories.items():
            self._evolutions[name].memory = memory
        self.model.restore(snapshot.tissue)
