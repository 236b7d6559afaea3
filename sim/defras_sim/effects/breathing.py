"""What lies under the tissue rises and falls."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from defras_sim.effects.effect import EffectParameter, Values
from defras_sim.effects.tissue_effect import Direction, Evolution, Terms, TissueEffect
from defras_sim.tissue.model import TissueModel
from defras_sim.tissue.parameters import AttachmentHeight, GraspShift, Parameter, TermParameter
from defras_sim.tissue.state import TissueState

AMPLITUDE, PERIOD, PHASE = "amplitude_m", "period_s", "phase_rad"
# Where nothing breathes yet, breaths of these periods are looked for beside the one given.
PERIODS_S = tuple(np.geomspace(2.0, 8.0, 9).tolist())
# Less than this a solve is not worth.
NOTICED_M = 5e-6


class Breathing(TissueEffect):
    """Bed and attachments move up and down as a sine of world time."""

    name = "breathing"
    rank = 9
    sentence = "What lies under the tissue rises and falls."
    parameters = (
        EffectParameter(
            AMPLITUDE, "m", null=0.0, lower=0.0, upper=0.03, step=0.001,
            meaning="half of the way between lowest and highest",
        ),
        EffectParameter(
            PERIOD, "s", null=4.0, lower=0.3, upper=60.0, step=0.5, strength=False,
            meaning="of one breath",
        ),
        EffectParameter(
            PHASE, "rad", null=0.0, lower=-2 * np.pi, upper=2 * np.pi, step=0.5, strength=False,
            meaning="of the sine at world time 0",
        ),
    )  # fmt: skip
    falsified_by = "The tissue lies still while the arms do."
    excited_by = "Holding still for two breaths."
    source = "One harmonic of respiratory motion; its period is 2 to 8 s."

    def begin(self, values: Values, model: TissueModel) -> Evolution:
        return _Breathes(_Breath(values[AMPLITUDE], values[PERIOD], values[PHASE]), model)


@dataclass(frozen=True)
class _Breath:
    amplitude_m: float
    period_s: float
    phase_rad: float

    def _angle(self, time_s: float) -> float:
        return 2 * np.pi * time_s / self.period_s + self.phase_rad

    def height_m(self, time_s: float) -> float:
        return self.amplitude_m * float(np.sin(self._angle(time_s)))

    def height_by(self, parameter: str, time_s: float) -> float:
        """Derivative of the height by a parameter."""
        turning = self.amplitude_m * float(np.cos(self._angle(time_s)))
        return {
            AMPLITUDE: float(np.sin(self._angle(time_s))),
            PERIOD: -turning * 2 * np.pi * time_s / self.period_s**2,
            PHASE: turning,
        }[parameter]


@dataclass(frozen=True)
class _Past:
    """Height [m] at the last solve; for each arm that holds, when it took the tissue [s], and what
    it then saw as upwards."""

    height_m: float
    grasped_s: Mapping[GraspShift, float]


class _Breathes(Evolution):
    memory: _Past = _Past(0.0, {})

    def __init__(self, breath: _Breath, model: TissueModel) -> None:
        self._breath, self._model = breath, model
        self._time_s = 0.0
        self._height_m = 0.0
        self._has_bed = False

    def before(self, time_s: float) -> bool:
        self._time_s, self._height_m = time_s, self._breath.height_m(time_s)
        return abs(self._height_m - self.memory.height_m) > NOTICED_M

    def terms(self, terms: Terms) -> Terms:
        self._has_bed = "bed" in terms
        return terms

    def lift_m(self) -> float:
        return self._height_m

    def after(self, time_s: float, state: TissueState) -> bool:
        tips = self._model.tips
        grasped = {s: t for s, t in self.memory.grasped_s.items() if s.arm in tips}
        for arm in tips.keys() - {shift.arm for shift in grasped}:
            x, y, z = tips[arm].rotation.T[:, 2].tolist()
            grasped[GraspShift(arm, (x, y, z))] = time_s
        self.memory = _Past(self._height_m, grasped)
        return False

    def directions(self) -> tuple[Direction, ...]:
        breath = self._breath
        if breath.amplitude_m > 0.0:
            return tuple(
                Direction(name, {}, self._lifts(partial(breath.height_by, name)))
                for name in (AMPLITUDE, PERIOD, PHASE)
            )
        units = (
            replace(breath, amplitude_m=1.0, period_s=period, phase_rad=phase)
            for period in sorted({breath.period_s, *PERIODS_S})
            for phase in (0.0, np.pi / 2)
        )
        return tuple(
            Direction(
                AMPLITUDE,
                {PERIOD: unit.period_s, PHASE: unit.phase_rad},
                self._lifts(unit.height_m),
            )
            for unit in units
        )

    def _lifts(self, by_m: Callable[[float], float]) -> dict[Parameter, float]:
        """What changes if heights change by ``by_m`` of the time: also where a jaw took tissue."""
        now = by_m(self._time_s)
        by: dict[Parameter, float] = {AttachmentHeight(): now}
        if self._has_bed:
            by[TermParameter("bed", "height_m")] = now
        for shift, time_s in self.memory.grasped_s.items():
            by[shift] = by_m(time_s)
        return by


EFFECT = Breathing()
