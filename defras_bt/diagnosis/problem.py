"""What the diagnosis engine is given: numbers to compare, and causes that could change them.

The engine knows no twin. A twin offers itself as a :class:`Problem`: residuals of a model, and how
they change with each candidate cause.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from defras_sim.effects.effect import Effect, EffectParameter, Extension, Values
from defras_sim.geometry import Floats

Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Channel:
    """One time series that is compared, in every trajectory.

    ``noise_sd`` is what the sensor itself is known to scatter. ``place_m`` (2,) is where on the
    tissue it is seen from above, if it has such a place. Residuals within ``floor`` are of no
    practical interest (discretisation, resolution).
    """

    name: str
    sensor: str
    unit: str
    noise_sd: float
    floor: float
    place_m: tuple[float, float] | None = None


@dataclass(frozen=True)
class Samples:
    """Labels (n,) of the n numbers that are compared, sorted by trajectory, channel and time.

    ``fold``: samples of the same fold are held out together. ``phase`` names what happened then
    ("rest", "pull", "hold", ...): an index into ``phases``.
    """

    channels: tuple[Channel, ...]
    trajectories: tuple[str, ...]
    phases: tuple[str, ...]
    time_s: Floats
    channel: Integers
    trajectory: Integers
    phase: Integers
    fold: Integers


@dataclass(frozen=True)
class Candidate:
    """A cause that may be named: an effect with some of its parameters free.

    ``site`` tells candidates of one effect apart ("q5", "x"); "" where there is one only.
    ``nuisance``: re-tuned before others are ranked, because it would explain a little of
    everything. ``base``: always fitted and never named, as the modulus of a specimen nobody
    measured before.
    """

    effect: Effect
    free: tuple[EffectParameter, ...]
    site: str = ""
    nuisance: bool = False
    base: bool = False

    @property
    def key(self) -> str:
        return f"{self.effect.name}@{self.site}" if self.site else self.effect.name


@dataclass(frozen=True)
class Tangent:
    """How predictions change near a starting point of a candidate.

    Prediction of the model with the candidate at ``at`` plus ``steps @ amplitudes`` is about the
    present one plus ``columns @ amplitudes``. ``columns`` (n, k); each of ``steps`` (k of them)
    maps parameters to their change per unit amplitude. A secant has one column: the change from
    null to a point, which ``at`` lacks and the step adds.
    """

    at: Mapping[str, float]
    steps: tuple[Mapping[str, float], ...]
    columns: Floats

    def values(self, amplitudes: Floats, free: Sequence[EffectParameter]) -> dict[str, float]:
        """Parameters at ``amplitudes`` (k,), kept within their bounds."""
        bounds = {p.name: (p.lower, p.upper) for p in free}
        found = dict(self.at)
        for step, amplitude in zip(self.steps, amplitudes, strict=True):
            for name, change in step.items():
                found[name] = found.get(name, 0.0) + change * float(amplitude)
        return {n: float(np.clip(v, *bounds[n])) if n in bounds else v for n, v in found.items()}


class Linearised(Protocol):
    """A twin that knows how its predictions change with each candidate cause."""

    @property
    def samples(self) -> Samples: ...

    @property
    def candidates(self) -> tuple[Candidate, ...]: ...

    def tangents(self, model: Extension, candidate: Candidate) -> Sequence[Tangent]:
        """How predictions change if ``candidate`` is added to (or, where ``model`` has it, moved
        in) ``model``: one where the null point has a derivative, several secants where it has
        none."""
        ...


class Problem(Linearised, Protocol):
    """Data of one or more trajectories beside a twin that predicts them."""

    def residual(self, model: Extension) -> Floats:
        """Measured minus predicted (n,) with the effects of ``model``; NaN where nothing is
        compared. Where the twin cannot follow ``model`` at all, every entry is NaN."""
        ...


@runtime_checkable
class Foreseeing(Protocol):
    """A problem whose twin takes long, and that works on several models side by side."""

    def foresee(self, models: Sequence[Extension]) -> None:
        """Residuals of ``models`` will be asked for next."""
        ...


@runtime_checkable
class Differentiating(Protocol):
    """A problem that knows derivatives where a model stands, for less than predictions cost."""

    def derivatives(
        self, model: Extension, candidates: Sequence[Candidate]
    ) -> Mapping[tuple[str, str], Floats]:
        """Change (n,) of the predictions per unit, by candidate key and free parameter, of
        ``candidates`` that ``model`` has; those that have to be measured are left out."""
        ...


@runtime_checkable
class Approximating(Protocol):
    """A problem whose twin is known to be off by itself, before any data: a mesh, a contact law."""

    def approximations(self, count: int, rng: np.random.Generator) -> Floats:
        """Draws (n, count) of such errors, in the units of the data. What they would give to the
        luckiest candidate counts as chance."""
        ...

    def systematic(
        self,
        residual: Floats,
        candidate: Candidate,
        columns: Mapping[str, Floats],
        rng: np.random.Generator,
    ) -> Values:
        """Standard error by parameter, in its unit, that more data would not lessen.

        ``residual`` (n,) is that of the fit; ``columns`` (n,) by parameter are the change of the
        predictions per unit."""
        ...


@runtime_checkable
class Approaching(Protocol):
    """A problem whose twin can be made more accurate near one model, and which knows how far it
    may be off there."""

    def approach(self, model: Extension) -> bool:
        """Stand at ``model``; whether residuals of models have changed by that. What
        :class:`Approximating` says is said of the model stood at last."""
        ...


@dataclass(frozen=True)
class Covariate:
    """Something that residuals may depend on: ``values`` (n,) for each of the samples, NaN where
    it does not concern one. ``followed``: the sensor should read this, so that a residual along
    its rate is a lag."""

    name: str
    unit: str
    values: Floats
    followed: bool = False


@runtime_checkable
class Covarying(Protocol):
    """A problem that knows what its residuals may depend on."""

    def covariates(self) -> Sequence[Covariate]:
        """For the portrait of the residual: set-points, insertion, height of the tip, ..."""
        ...


@runtime_checkable
class Remarking(Protocol):
    """A problem that knows what its data say beside any effect."""

    def remarks(self, model: Extension) -> Sequence[str]:
        """Sentences a reader of the verdict should know of what ``model`` cannot follow."""
        ...


@runtime_checkable
class Extrapolating(Protocol):
    """A problem whose data reach far enough that what is said beyond a range can be scored."""

    def split_by_range(self) -> tuple[Problem, Problem, str] | None:
        """Where little was asked of the model (to fit) and where more was (to score), with the
        same candidates, and in words where the line is drawn ("a stretch of 4.1"); None where the
        data do not reach far enough."""
        ...
