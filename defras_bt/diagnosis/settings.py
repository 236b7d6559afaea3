"""What a diagnosis may be told about how sure and how thorough it has to be."""

from __future__ import annotations

from dataclasses import dataclass

from defras_bt.diagnosis.problem import Approximating, Problem

_OUTSIDE = 0.25
_OUTSIDE_KNOWN = 0.02


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
        outside_share: more of the excess than this left over, and structured, is "outside"; None:
            as :func:`outside_share` says.
        alike: a pair of causes whose difference is seen in fewer than this share of repetitions of
            the same measurement is a set.
    """

    false_alarm: float = 0.05
    surrogates: int = 300
    tried: int = 6
    causes: int = 12
    iterations: int = 6
    relative_gain: float = 0.03
    outside_share: float | None = None
    alike: float = 0.01
    predictions: int = 150


def outside_share(settings: Settings, problem: Problem) -> float:
    """Share of the excess beyond which what is left beside causes makes the verdict "outside".

    A twin that knows how far it is off by itself (:class:`Approximating`) finds only what is beyond
    that, so little of it tells that something else is there: a fiftieth, which only keeps "outside"
    from what hardly matters. For others it is a quarter: joints and specimens that were measured
    have left up to 23 % beside the right cause, where it was known.
    """
    if settings.outside_share is not None:
        return settings.outside_share
    return _OUTSIDE_KNOWN if isinstance(problem, Approximating) else _OUTSIDE
