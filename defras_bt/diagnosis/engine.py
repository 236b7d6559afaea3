"""From a problem to a diagnosis: the whole way, and what is left of it when interrupted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from defras_bt.diagnosis.beginning import begun, fitted_base
from defras_bt.diagnosis.columns import sketch
from defras_bt.diagnosis.confounding import confounding_of
from defras_bt.diagnosis.diagnosis import Diagnosis
from defras_bt.diagnosis.excess import removed_share
from defras_bt.diagnosis.exclusion import exclusions
from defras_bt.diagnosis.findings import Findings
from defras_bt.diagnosis.fitted import Fit, bare
from defras_bt.diagnosis.fitting import differentiate, refine
from defras_bt.diagnosis.further import measure_further
from defras_bt.diagnosis.intervals import estimates, standard_errors
from defras_bt.diagnosis.outside import left_over
from defras_bt.diagnosis.plain_squares import fit_plainly
from defras_bt.diagnosis.problem import Approximating, Problem, Remarking
from defras_bt.diagnosis.proposal import proposed_motion
from defras_bt.diagnosis.search import Progress
from defras_bt.diagnosis.selection import select
from defras_bt.diagnosis.sets import rivals, simpler
from defras_bt.diagnosis.settings import Settings
from defras_bt.diagnosis.verdict_building import diagnosis_of
from defras_sim.effects.effect import EffectParameter, Values
from defras_sim.geometry import Floats

_FAR_ABOVE = 3.0
"""Of what chance reaches: no interval makes a cause doubtful that is above it."""
_NOTICED = 0.05
"""Of the held-out loss: what a cause has to be worth where chance reaches nothing at all."""
_NARROWEST, _WIDEST = 0.02, 2.0
"""Steps over which derivatives are taken."""


def diagnose(
    problem: Problem,
    rng: np.random.Generator,
    *,
    settings: Settings | None = None,
    progress: Progress | None = None,
    beyond_range: Problem | None = None,
    new_grasp: Problem | None = None,
) -> Diagnosis:
    """Find what makes ``problem``'s twin differ from its data.

    ``beyond_range`` and ``new_grasp`` are problems with the same candidates and other data, on
    which the gain is measured and nothing is fitted. ``progress`` is told a sentence and the share
    of it that is done. An interrupt (Ctrl-C) ends the search; what was found until then is
    returned, marked incomplete. Before the plain model's residual is known there is nothing to
    return, and the interrupt passes on.

    Raises:
        ValueError: the problem's samples or tangents contradict themselves.
    """
    told = progress or _silent
    told("what the plain model says", 0.0)
    found = _begun(problem, settings or Settings(), rng)
    try:
        _look(found, told)
        select(found.search, told)
        fit_plainly(found.search)
        _settle(found, told)
        told("what was gained on other data", 0.9)
        measure_further(found, beyond_range, new_grasp)
        if isinstance(problem, Remarking):
            found.remarks += tuple(problem.remarks(found.search.fit.model))
        if found.search.was_cut_short:
            found.remarks += (
                f"The search ended after {found.search.counted.calls} predictions of the "
                "twin; weaker causes beside what was found were not looked for.",
            )
        found.complete = True
    except KeyboardInterrupt:
        told("interrupted; what was found until now is kept", 1.0)
    return diagnosis_of(found)


def _silent(sentence: str, share: float) -> None:
    pass


def _begun(problem: Problem, settings: Settings, rng: np.random.Generator) -> Findings:
    search = begun(problem, settings, rng)
    return Findings(search, search.fit)


def _look(found: Findings, told: Progress) -> None:
    """Fit the base, see what each candidate would change, and what looks alike."""
    search = found.search
    problem = search.counted.problem
    search.fit, search.noise = fitted_base(search, told)
    found.base = search.fit
    told("what each effect would change", 0.0)
    search.sketch = sketch(problem, found.base.model, problem.candidates, told)
    found.confounding = confounding_of(search.sketch, search.samples)


def _settle(found: Findings, told: Progress) -> None:
    """Intervals, rivals, what is left over, and what is excluded."""
    search = found.search
    while search.fit.free:
        told("how well parameters are known", 0.5)
        _arrived(found)
        doubtful = [key for key in search.accepted() if _may_be_absent(found, key)]
        if not doubtful:
            break
        # The last that came is the one that the others may have called for.
        _doubt(found, doubtful[-1], told)
    _compare(found, told)
    told("which motion would tell causes apart", 0.55)
    found.proposed = proposed_motion(search, found.ambiguous())
    told("what each cause gains", 0.6)
    _measure_gains(found)
    told("what is left over", 0.7)
    left = search.held_out(search.fit, search.noise).residual
    count = search.settings.surrogates
    off = search.approximations(count)
    found.left = left_over(left, search.samples, search.noise, count, search.rng, off)
    told("what is excluded", 0.8)
    found.excluded, found.unseen = exclusions(search)


def _doubt(found: Findings, key: str, told: Progress) -> None:
    """Take out a cause that may as well be absent; others may have stood in its shadow."""
    search = found.search
    search.take_out(key)
    search.doubted += (key,)
    select(search, told)
    fit_plainly(search)
    found.estimates.clear()


def _compare(found: Findings, told: Progress) -> None:
    """Rivals of every cause. A cause that explains no more than a special case of it gives way, and
    what was compared with it is compared anew."""
    search = found.search
    gone: set[str] = set()
    while (left := [key for key in search.accepted() if key not in found.rivals]) != []:
        key = left[0]
        alike = rivals(search, key, found.confounding, told)
        special = simpler(search, key, alike)
        if special is None or special in gone:
            found.rivals[key] = alike
            continue
        gone.add(key)
        search.put_instead(key, special, alike[special])
        _arrived(found)
        del found.estimates[key]
        found.rivals.clear()


def _may_be_absent(found: Findings, key: str) -> bool:
    """Whether the intervals of all of a cause's strengths contain their null: a name for what may
    as well not be there helps nobody.

    An interval is that of the derivatives where the fit arrived. Where a little more or less of a
    firm hold changes nothing it is as wide as the bounds, and says nothing of none at all; so a
    cause without which other data are predicted far worse stays.
    """
    search = found.search
    candidate = search.sketch.candidate(key)
    less = bare(search.counted, search.fit, key)
    worse = search.held_out(less, search.noise).total / (
        search.held_out(search.fit, search.noise).total
    )
    limits = [each.threshold for each in search.rounds if each.accepted == key]
    if limits and worse - 1.0 > max(_FAR_ABOVE * limits[-1], _NOTICED):
        return False
    strengths = [p for p in candidate.free if p.strength]
    estimated = found.estimates[key]

    def contains_null(p: EffectParameter) -> bool:
        low, high = estimated[p.name].interval90
        return low <= p.null <= high

    return bool(strengths) and all(contains_null(p) for p in strengths)


def _measure_gains(found: Findings) -> None:
    """What would come back, held out, if a cause were taken out and the others re-tuned."""
    search = found.search
    before = search.held_out(found.base, search.noise).residual
    whole = removed_share(
        before, search.held_out(search.fit, search.noise).residual, search.samples
    )
    for key in search.accepted():
        less = bare(search.counted, search.fit, key)
        left = search.held_out(less, search.noise).residual
        part = removed_share(before, left, search.samples)
        if whole is not None and part is not None:
            found.gains[key] = whole - part


def _arrived(found: Findings) -> None:
    """Fresh derivatives of the fit, what they still gain, and the intervals that follow."""
    search = found.search

    def errors(fit: Fit) -> Floats:
        return standard_errors(
            fit.jacobian,
            fit.residual,
            search.fitted_with or search.noise,
            search.samples,
            search.settings.surrogates,
            search.rng,
        )

    widths = np.clip(errors(search.fit), _NARROWEST, _WIDEST)
    fresh = differentiate(search.counted, search.fit, widths)
    search.fit = refine(search.counted, fresh, search.fitted_with or search.noise, iterations=2)
    # The steps just made keep derivatives current on too small a scale.
    known = errors(replace(search.fit, jacobian=fresh.jacobian))
    problem = search.counted.problem
    for candidate in search.fit.candidates:
        systematic: Values = {}
        if isinstance(problem, Approximating):
            columns = {
                p.name: column / p.step
                for (key, p), column in zip(fresh.free, fresh.jacobian.T, strict=True)
                if key == candidate.key
            }
            systematic = problem.systematic(search.fit.residual, candidate, columns, search.rng)
        found.estimates[candidate.key] = estimates(search.fit, candidate, known, systematic)
