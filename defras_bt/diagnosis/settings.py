"""What a diagnosis may be told about how sure and how thorough it has to be."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Levels and budgets of a diagnosis.

    Attributes:
        false_alarm: how often anything may be named where there is nothing.
        surrogates: residuals of the same autocorrelation that chance is measured with.
        tried: candidates that are fitted fully in each round, at most.
        causes: how many causes may be named at most.
        iterations: of a full fit; each costs a call of the residual, or a few.
        relative_gain: share of the remaining excess that a cause has to remove, held out.
        outside_share: more of the excess than this left over, and structured, is "outside". Where
            the true cause is lacking, the best fit of another one has left from nothing to 45 %;
            where it is known, measured data have left up to 23 %.
        predictions: of a twin that takes long, after which no further cause is looked for.
        alike: a pair of causes whose difference is seen in fewer than this share of repetitions of
            the same measurement is a set.
    """

    false_alarm: float = 0.05
    surrogates: int = 300
    tried: int = 6
    causes: int = 12
    iterations: int = 6
    relative_gain: float = 0.03
    outside_share: float = 0.25
    alike: float = 0.025
    predictions: int = 150
