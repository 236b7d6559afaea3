"""Stress fades while the tissue is held."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from defras_sim.effects.coupon_effect import CouponEffect, Pull
from defras_sim.effects.effect import EffectParameter, Values
from defras_sim.effects.tissue_effect import (
    Direction,
    Evolution,
    Terms,
    TissueEffect,
    material_parts,
)
from defras_sim.geometry import Floats
from defras_sim.tissue.fading import Fading, Step
from defras_sim.tissue.matrices import jit
from defras_sim.tissue.model import TissueModel
from defras_sim.tissue.parameters import DentStiffness, TermParameter
from defras_sim.tissue.prestress import second_piola_pa
from defras_sim.tissue.softened import Part, density_and_stress
from defras_sim.tissue.state import TissueState

# Where nothing fades yet, fading is looked for with these times beside the one given.
TIMES_S = (0.5, 2.0, 8.0)
# Differences of the dents' stiffness that call for another solve.
DENTS_NOTICED = 0.02
# Of the modulus: stresses below this say nothing about what has faded.
STRESSED = 1e-4
# Of the stiffness: while a hold changes stresses by less (rms), a solve is not worth it.
NOTICED = 1e-4


class StressRelaxation(TissueEffect, CouponEffect):
    """Quasi-linear viscoelasticity: of each elastic stress, ``fraction`` fades within ``time_s``.

    sigma(t) = integral of G(t - s) d sigma_elastic(s), G(t) = 1 - f (1 - exp(-t / tau)). The
    elastic law is the fast one: at once after a step the model without the effect is right.
    """

    name = "stress_relaxation"
    rank = 3
    twins = ("tissue", "coupon")
    sentence = "Stress fades while the tissue is held."
    parameters = (
        EffectParameter(
            "fraction", "1", null=0.0, lower=0.0, upper=0.95, step=0.1,
            meaning="share of a held stress that fades in the end",
        ),
        EffectParameter(
            "time_s", "s", null=2.0, lower=0.05, upper=5000.0, step=1.0,
            meaning="time in which it fades to 1/e of itself", strength=False,
        ),
    )  # fmt: skip
    falsified_by = (
        "The force stays while the tissue is held; or the share that fades, or the time it takes, "
        "depends on how far the tissue was stretched (then viscosity is there, but not this one)."
    )
    excited_by = "A pull within a tenth of the time, then a hold for three times as long."
    source = "Y. C. Fung, Biomechanics, 2nd ed. (1993), section 7.6."

    coupon_stage = "memory"

    def on_coupon(self, values: Values, pull: Pull) -> Pull:
        at = self.complete(values)
        if at["fraction"] == 0:
            return pull
        fading = fading_memory(pull.time_s, pull.stress_pa, at["time_s"])
        fraction = at["fraction"]
        return replace(pull, stress_pa=(1 - fraction) * pull.stress_pa + fraction * fading)

    def begin(self, values: Values, model: TissueModel) -> Evolution:
        return _Fades(values["fraction"], values["time_s"], model)


@dataclass(frozen=True)
class _Past:
    """The last solve: its time, the elastic stress (elements, points, 3, 3) and, for each time
    constant, the fading one."""

    time_s: float
    stress_pa: Floats
    fading_pa: tuple[Floats, ...]


class _Fades(Evolution):
    """Before its first solve the tissue has lain for ever: of the stress that its weight makes,
    nothing is left to fade.

    What happens in the dents of holes and jaws is not among the terms; they fade as the tissue does
    on average, or a coarse mesh, which has deeper dents, would hold more of its force.
    """

    memory: _Past | None = None

    def __init__(self, fraction: float, tau_s: float, model: TissueModel) -> None:
        self._fraction = fraction
        self._young_pa = model.scene.tissue.young_modulus_pa
        others = () if fraction > 0 else tuple(t for t in TIMES_S if t != tau_s)
        self._taus_s = (tau_s, *others)
        self._elastic: tuple[Part, ...] = ()
        self._steps = tuple(Step(0.0) for _ in self._taus_s)
        self._faded = tuple(0.0 for _ in self._taus_s)

    def before(self, time_s: float) -> bool:
        past = self.memory
        if past is None:
            return False
        if time_s < past.time_s:
            raise ValueError(
                f"world time went back from {past.time_s:g} s to {time_s:g} s; what fades cannot"
            )
        self._steps = tuple(Step((time_s - past.time_s) / tau) for tau in self._taus_s)
        faded = self._fraction * (1 - self._steps[0].left)
        rms_pa = np.sqrt(np.mean(past.fading_pa[0] ** 2))
        return bool(faded * rms_pa > NOTICED * self._young_pa)

    def terms(self, terms: Terms) -> Terms:
        elastic = material_parts(terms)
        self._elastic = elastic
        self._faded = tuple(self._faded_at(number) for number in range(len(self._taus_s)))
        ahead = self._ahead()
        term = Fading.of(elastic[0].points, elastic, self._fraction, ahead)
        if self._fraction == 0.0:
            return {**terms, term.name: term}
        factor = 1 - self._fraction * (1 - ahead[0][1])
        scaled = {part.name: part.scaled(factor) for part in elastic}
        return {**terms, **scaled, term.name: term}

    def after(self, time_s: float, state: TissueState) -> bool:
        past = self.memory
        F = self._elastic[0].points.deformation(state.nodes_m)
        stress = second_piola_pa(F, density_and_stress(self._elastic, F)[1])
        if past is None:
            fading = tuple(np.zeros_like(stress) for _ in self._taus_s)
        else:
            change = stress - past.stress_pa
            fading = tuple(
                step.memory(before, change)
                for step, before in zip(self._steps, past.fading_pa, strict=True)
            )
        self.memory = _Past(time_s, stress, fading)
        self._steps = tuple(Step(0.0) for _ in self._taus_s)
        return self._fraction * abs(self._faded_at(0) - self._faded[0]) > DENTS_NOTICED

    def dent_factor(self) -> float:
        """Dents fade as the rest of the tissue does, on average."""
        return 1 + self._fraction * self._faded[0]

    def _faded_at(self, number: int) -> float:
        """By how much (-1 to 0) stress has faded by now at one of the time constants, if all of it
        does: (e H - S):S by S:S, summed over the tissue."""
        past = self.memory
        if past is None:
            return -1.0
        volumes = self._elastic[0].points.volumes_m3[:, :, None, None]
        weighted = volumes * past.stress_pa
        faded = self._steps[number].left * past.fading_pa[number] - past.stress_pa
        least = np.sum(volumes) * (STRESSED * self._young_pa) ** 2
        share = np.vdot(weighted, faded) / (np.vdot(weighted, past.stress_pa) + least)
        return float(np.clip(share, -1.0, 0.0))

    def directions(self) -> tuple[Direction, ...]:
        return tuple(
            Direction(
                "fraction",
                {"time_s": tau},
                {
                    TermParameter("stress_relaxation", f"fraction_{number}"): 1.0,
                    DentStiffness(): faded / self.dent_factor(),
                },
            )
            for number, (tau, faded) in enumerate(zip(self._taus_s, self._faded, strict=True))
        )

    def _ahead(self) -> list[tuple[Floats, float]]:
        """For each time constant: e H_before - g S_before, and g (see the module on fading)."""
        past = self.memory
        if past is None:
            nothing = np.zeros((*self._elastic[0].points.volumes_m3.shape, 3, 3))
            return [(nothing, 0.0) for _ in self._taus_s]
        return [
            (step.left * fading - step.arriving * past.stress_pa, step.arriving)
            for step, fading in zip(self._steps, past.fading_pa, strict=True)
        ]


@jit
def fading_memory(time_s: Floats, stress_pa: Floats, tau_s: float) -> Floats:
    """Integral of exp(-(t - s) / tau) d stress(s) (n,), exact where stress is linear between rows.

    Before the first row the specimen rested: a first stress that is not zero came at once.
    """
    fading = np.empty_like(stress_pa)
    fading[0] = stress_pa[0]
    for row in range(1, len(stress_pa)):
        passed = (time_s[row] - time_s[row - 1]) / tau_s
        left = np.exp(-passed)
        arriving = -np.expm1(-passed) / passed if passed > 0 else 1.0
        fading[row] = left * fading[row - 1] + arriving * (stress_pa[row] - stress_pa[row - 1])
    return fading


EFFECT = StressRelaxation()
