"""Diagnosis: a verdict with everything that led to it, as data for reports."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from defras_bt.diagnosis.problem import Candidate, Integers, Samples
from defras_bt.diagnosis.verdict import Verdict
from defras_sim.effects.effect import Extension
from defras_sim.geometry import Floats

StatisticKind = Literal[
    "rms", "mean", "reversal", "drift", "lag", "slope", "mode", "rigid", "jump", "line"
]


@dataclass(frozen=True)
class Statistic:
    """One number of the residual portrait that makes a kind of cause visible.

    ``value`` in ``unit``; ``chance`` is what noise of the same autocorrelation reaches in 5 % of
    cases (None where it was not asked). ``channel``, ``phase``, ``trajectory`` are "" where the
    statistic is over all of them.
    """

    kind: StatisticKind
    sensor: str
    value: float
    unit: str
    sentence: str
    chance: float | None = None
    channel: str = ""
    phase: str = ""
    trajectory: str = ""

    @property
    def stands_out(self) -> bool:
        """More than chance would give."""
        return self.chance is not None and abs(self.value) > self.chance


@dataclass(frozen=True)
class Ranked:
    """One candidate by the linearised model, others than it re-tuned before.

    ``gain``: share of the whitened squared residual that it explains in the data it was fitted
    to; ``held_out``: held-out loss it removes, relative to what is left (may be negative).
    ``visible``: whether anything observable changes with it at all. ``start``: where a full fit
    of it would begin.
    """

    key: str
    gain: float
    held_out: float
    visible: bool
    start: Mapping[str, float]


@dataclass(frozen=True)
class RankedPair:
    """Two candidates together, as :class:`Ranked`."""

    keys: tuple[str, str]
    gain: float


@dataclass(frozen=True)
class Trial:
    """A candidate that was fitted fully in one round of the selection.

    ``held_out`` as in :class:`Ranked`; ``practical``: whether what it changes is more than the
    practical floor.
    """

    key: str
    model: Extension
    held_out: float
    practical: bool
    calls: int


@dataclass(frozen=True)
class Round:
    """One round of the selection: who was tried, what chance reaches, who was accepted (or, in
    the backward pass, ``removed``)."""

    trials: tuple[Trial, ...]
    threshold: float
    accepted: str | None
    removed: str | None = None


@dataclass(frozen=True)
class Confounding:
    """Which candidates explain the same: known from the tangents alone, before any data.

    ``cosine`` (k, k): largest cosine between what two candidates do to the predictions, after
    nuisances and base were projected out; 1 where they cannot be told apart with these motions.
    ``shift``: what one step of each candidate does, root mean square in tolerances of the
    channels, before and after that projection.
    """

    keys: tuple[str, ...]
    cosine: Floats
    shift: Floats
    shift_after: Floats

    def alike(self, key: str, limit: float = 0.95) -> tuple[str, ...]:
        """Candidates whose cosine with ``key`` is at least ``limit``, the most alike first."""
        row = self.cosine[self.keys.index(key)]
        order = sorted(range(len(self.keys)), key=lambda i: -row[i])
        return tuple(self.keys[i] for i in order if row[i] >= limit and self.keys[i] != key)


@dataclass(frozen=True)
class ExcessOf:
    """Mean square of a sensor's residual above what the sensor scatters, in units of its
    tolerance squared; ``plain`` and ``extended`` model, both held out."""

    sensor: str
    unit: str
    plain: float
    extended: float
    plain_rms: float
    extended_rms: float
    noise_rms: float


@dataclass(frozen=True)
class Diagnosis:
    """All of it. ``complete``: False where it was interrupted; what is there is then what had been
    found.

    ``residual_*`` (n,): of the model with ``base`` only and with all that was accepted
    (``model``), NaN where nothing is compared; ``held_out_*`` (n,): the same with every fold
    predicted from the others. ``fold_gain`` (f,): share of the excess removed per held-out fold.
    ``partial`` are effects that explain a part and are not named because too much is left.
    ``unseen``: candidates that change nothing observable in these motions.
    """

    verdict: Verdict
    samples: Samples
    candidates: tuple[Candidate, ...]
    base: Extension
    model: Extension
    residual_before: Floats
    residual_after: Floats
    held_out_before: Floats
    held_out_after: Floats
    fold_gain: Floats
    excess: tuple[ExcessOf, ...]
    portrait: tuple[Statistic, ...]
    portrait_after: tuple[Statistic, ...]
    ranking: tuple[Ranked, ...]
    pairs: tuple[RankedPair, ...]
    rounds: tuple[Round, ...]
    confounding: Confounding
    partial: tuple[str, ...]
    unseen: tuple[str, ...]
    residual_calls: int
    complete: bool


def rows_of(
    samples: Samples, *, channel: int | None = None, trajectory: int | None = None
) -> Integers:
    """Indices of the samples of a channel and of a trajectory (None: of all)."""
    keep = samples.channel >= 0
    if channel is not None:
        keep = keep & (samples.channel == channel)
    if trajectory is not None:
        keep = keep & (samples.trajectory == trajectory)
    return keep.nonzero()[0]
