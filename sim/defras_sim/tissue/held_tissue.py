"""What acts on a tissue, term by term: itself, its attachments, and the arms that hold it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from defras_sim.geometry import Floats, Pose
from defras_sim.tissue import grasp as grips
from defras_sim.tissue import holes as attachments
from defras_sim.tissue.equilibrium import PotentialEnergy
from defras_sim.tissue.grasp import Grasp
from defras_sim.tissue.holes import Holes
from defras_sim.tissue.rest import is_loaded
from defras_sim.tissue.springs import Springs, SpringTerm
from defras_sim.tissue.terms import Term
from defras_sim.tissue.travel import Tips


class HeldTissue:
    """The terms of a tissue's energy, kept in step with its holes and grasps.

    :attr:`energy` is laid out anew where other nodes are coupled than before; methods say whether
    that happened.
    """

    def __init__(self, nodes: int, own: Iterable[Term], holes: Holes) -> None:
        """``own`` are the terms beside those of ``holes`` and of grasps, of which there is none."""
        self._nodes = nodes
        self._own = {term.name: term for term in own}
        self._holes = holes
        self._grasps: dict[str, Grasp] = {}
        self._dent_factor = 1.0
        self._stiffer: dict[str, tuple[Springs, float, Springs]] = {}
        """By term: springs, by how much their dents are stiffer, and what that gave."""
        self._energy = self._laid_out()

    @property
    def energy(self) -> PotentialEnergy:
        """With every holding arm's tip where it is."""
        return self._energy

    @property
    def attachments(self) -> SpringTerm:
        """The term by which the holes hold."""
        return self._dented(self._holes.term)

    @property
    def grasps(self) -> Mapping[str, Grasp]:
        return self._grasps

    @property
    def tips(self) -> dict[str, Pose]:
        """Where the holding arms' tips are."""
        return {arm: grasp.tissue_from_tip for arm, grasp in self._grasps.items()}

    @property
    def is_loaded(self) -> bool:
        return is_loaded(self._own.values())

    @property
    def hole_stiffness_n_per_m(self) -> Floats:
        """Stiffness of every hole (holes,)."""
        return self._holes.stiffness_n_per_m

    def set_hole_stiffness(self, stiffness_n_per_m: Floats) -> None:
        """Lays the energy out anew.

        Raises:
            ValueError: wrong count, negative, or not finite.
        """
        self._holes.stiffness_n_per_m = stiffness_n_per_m
        self._energy = self._laid_out()

    def lift_attachments(self, height_m: float) -> bool:
        """Hold the tissue ``height_m`` higher than modelled; whether that is news.

        Raises:
            ValueError: not finite.
        """
        if height_m == self._holes.height_m:
            return False
        self._holes.height_m = height_m
        self._energy = self._energy.with_term(self.attachments)
        return True

    def scale_dents(self, factor: float) -> bool:
        """Let the dents of holes and jaws be those of tissue ``factor`` times as stiff; whether
        that is news.

        Raises:
            ValueError: not above zero, or not finite.
        """
        if factor == self._dent_factor:
            return False
        if not (np.isfinite(factor) and factor > 0):
            raise ValueError(f"dents can be scaled by a number above 0, not by {factor}")
        self._dent_factor = factor
        self._energy = self.energy_at(self.tips).with_term(self.attachments)
        return True

    def set_term(self, term: Term) -> bool:
        """Add ``term``, or put it in the place of the one of its name; whether laid out anew.

        Raises:
            ValueError: the name is that of the attachments or of a grasp, which follow the holes
                and the arms.
        """
        if term.name == attachments.TERM_NAME or term.name in map(grips.term_name, self._grasps):
            raise ValueError(
                f"term {term.name!r} follows the holes and the arms; use set_hole_stiffness, "
                "grasp, release and solve"
            )
        old = self._own.get(term.name)
        self._own[term.name] = term
        if old is not None and old.pairs is term.pairs:
            self._energy = self._energy.with_term(term)
            return False
        self._energy = self._laid_out()
        return True

    def remove_term(self, name: str) -> None:
        """Lays the energy out anew.

        Raises:
            ValueError: there is none of that name, or the tissue cannot be without it.
        """
        if name == "material" or name not in self._own:
            known = ", ".join(other for other in self._own if other != "material")
            raise ValueError(f"no term {name!r} to take away; there are: {known}")
        del self._own[name]
        self._energy = self._laid_out()

    def hold(self, grasps: Mapping[str, Grasp]) -> bool:
        """These grasps and no others hold from now on; whether laid out anew."""
        others = grips.spring_order(grasps) != grips.spring_order(self._grasps)
        self._grasps = dict(grasps)
        self._energy = self._laid_out() if others else self.energy_at(self.tips)
        return others

    def move(self, tips: Tips) -> None:
        """Take the holding arms' tips to their poses in ``tips``."""
        self._energy = self.energy_at(tips)
        self._grasps = self._grasps_at(tips)

    def energy_at(self, tips: Tips) -> PotentialEnergy:
        """The energy with each holding arm's tip at its pose in ``tips``."""
        energy = self._energy
        for arm, grasp in self._grasps_at(tips).items():
            energy = energy.with_term(self._dented(grasp.term(arm)))
        return energy

    def energy_let_go(self) -> PotentialEnergy:
        """The energy if no arm held."""
        return PotentialEnergy(self._nodes, [*self._own.values(), self.attachments])

    def _grasps_at(self, tips: Tips) -> dict[str, Grasp]:
        return {
            arm: replace(grasp, tissue_from_tip=tips[arm]) for arm, grasp in self._grasps.items()
        }

    def _laid_out(self) -> PotentialEnergy:
        held = [self._dented(grasp.term(arm)) for arm, grasp in self._grasps.items()]
        return PotentialEnergy(self._nodes, [*self._own.values(), self.attachments, *held])

    def _dented(self, term: SpringTerm) -> SpringTerm:
        """``term`` with its dents as stiff as they are by now."""
        if self._dent_factor == 1.0:
            return term
        springs, factor, stiffer = self._stiffer.get(term.name, (None, 0.0, None))
        if stiffer is None or springs is not term.springs or factor != self._dent_factor:
            stiffer = term.springs.in_stiffer_tissue(self._dent_factor)
            self._stiffer[term.name] = term.springs, self._dent_factor, stiffer
        return replace(term, springs=stiffer)
