"""The gain on data that nothing was fitted to: beyond the range, at a new grasp."""

from __future__ import annotations

from defras_bt.diagnosis.beginning import begun, fitted_base, start_and_extend
from defras_bt.diagnosis.columns import sketch
from defras_bt.diagnosis.excess import removed_share
from defras_bt.diagnosis.findings import Findings
from defras_bt.diagnosis.fitted import Fit
from defras_bt.diagnosis.problem import Extrapolating, Problem, Remarking


def measure_further(
    found: Findings, beyond_range: Problem | None, new_grasp: Problem | None
) -> None:
    """Measure what the accepted model gains on other data, and say where it loses.

    Where no data beyond the range are given and the problem can be split by range, the same causes
    are fitted anew to the lower part and scored on the upper.
    """
    for name, words, further in (
        ("beyond_range", "beyond the range it was fitted in", beyond_range),
        ("new_grasp", "at the new grasp", new_grasp),
    ):
        if further is not None and found.search.accepted():
            gain = _gain(further, found.base, found.search.fit)
            found.further[name] = gain
            found.remarks += _warned(gain, words)
            if isinstance(further, Remarking):
                said = further.remarks(found.search.fit.model)
                found.remarks += tuple(f"{words.capitalize()}: {sentence}" for sentence in said)
    problem = found.search.counted.problem
    if beyond_range is not None or not found.search.accepted():
        return
    parts = problem.split_by_range() if isinstance(problem, Extrapolating) else None
    if parts is None:
        return
    lower, upper, line = parts
    refitted = _refitted(found, lower)
    if refitted is not None:
        gain = _gain(upper, *refitted)
        found.further["beyond_range"] = gain
        found.remarks += _warned(gain, f"when fitted below {line} and asked beyond")


def _gain(further: Problem, base: Fit, extended: Fit) -> float | None:
    return removed_share(
        further.residual(base.model), further.residual(extended.model), further.samples
    )


def _warned(gain: float | None, words: str) -> tuple[str, ...]:
    if gain is None or gain >= 0.0:
        return ()
    return (
        f"The extended model predicts worse than the plain one {words}: do not extrapolate it.",
    )


def _refitted(found: Findings, lower: Problem) -> tuple[Fit, Fit] | None:
    """Base, and base with the accepted causes, fitted to ``lower``; None where the twin cannot."""
    search = begun(lower, found.search.settings, found.search.rng)
    base, noise = fitted_base(search, _silent)
    candidates = sketch(lower, base.model, [c for c in found.search.fit.candidates if not c.base])
    fit: Fit | None = base
    for key in found.search.accepted():
        if fit is not None:
            fit = start_and_extend(search, fit, noise, candidates, key)
    return None if fit is None else (base, fit)


def _silent(sentence: str, share: float) -> None:
    pass
