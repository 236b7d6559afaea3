"""The verdict: from what was found to named, set, outside or nothing."""

from __future__ import annotations

import math

import numpy as np

from defras_bt.diagnosis.diagnosis import Diagnosis, Statistic
from defras_bt.diagnosis.excess import excess_by_sensor, removed_share
from defras_bt.diagnosis.findings import Findings
from defras_bt.diagnosis.portrait import portrait
from defras_bt.diagnosis.problem import Covarying
from defras_bt.diagnosis.settings import outside_share
from defras_bt.diagnosis.verdict import Cause, Estimate, Gain, Verdict, VerdictName
from defras_sim.geometry import Floats


def diagnosis_of(found: Findings) -> Diagnosis:
    """Everything that was found, with the verdict that follows from it."""
    search = found.search
    samples = search.samples
    before = search.held_out(found.base, search.noise).residual
    after = search.held_out(search.fit, search.noise).residual
    verdict = _verdict(found, before, after)
    folds = [
        removed_share(
            np.where(samples.fold == fold, before, np.nan),
            np.where(samples.fold == fold, after, np.nan),
            samples,
        )
        for fold in np.unique(samples.fold)
    ]
    return Diagnosis(
        verdict=verdict,
        samples=samples,
        candidates=search.sketch.candidates,
        base=found.base.model,
        model=search.fit.model,
        residual_before=found.base.residual,
        residual_after=search.fit.residual,
        held_out_before=before,
        held_out_after=after,
        fold_gain=np.array([np.nan if gain is None else gain for gain in folds]),
        excess=excess_by_sensor(before, after, samples),
        portrait=_portrait(found, found.base.residual),
        portrait_after=_portrait(found, search.fit.residual),
        ranking=search.ranking,
        pairs=search.pairs,
        rounds=tuple(search.rounds),
        confounding=found.confounding,
        partial=search.accepted() if verdict.verdict == "outside" else (),
        unseen=found.unseen,
        residual_calls=search.counted.calls,
        complete=found.complete,
    )


def _portrait(found: Findings, residual: Floats) -> tuple[Statistic, ...]:
    """A residual beside noise as the best model leaves it: what that model explains stands out."""
    search = found.search
    problem = search.counted.problem
    covariates = problem.covariates() if isinstance(problem, Covarying) else ()
    return portrait(
        residual,
        search.samples,
        search.layout,
        search.noise,
        search.fit.residual,
        covariates,
        search.rng,
    )


def _verdict(found: Findings, before: Floats, after: Floats) -> Verdict:
    search = found.search
    removed = removed_share(before, after, search.samples)
    accepted = search.accepted()
    if removed is not None and removed < search.settings.relative_gain:
        # As where a cause is clear in numbers that are as near as their sensors can tell.
        accepted = ()
    left = None if removed is None else 1.0 - removed
    limit = outside_share(search.settings, search.counted.problem)
    too_much = not accepted or (left is not None and left > limit)
    outside = bool(found.left.sensors) and too_much
    ambiguous = found.ambiguous() if accepted else {}
    name: VerdictName = "nothing"
    if outside:
        name = "outside"
    elif any(ambiguous.values()):
        name = "set"
    elif accepted:
        name = "named"
    together = dict.fromkeys(
        _effect(key) for cause, others in ambiguous.items() if others for key in (cause, *others)
    )
    return Verdict(
        verdict=name,
        causes=() if outside else tuple(_cause(found, key) for key in accepted),
        ambiguous=() if outside else tuple(together),
        excluded={} if outside else found.excluded,
        gain=Gain(
            removed if accepted else None,
            found.further.get("beyond_range") if accepted else None,
            found.further.get("new_grasp") if accepted else None,
        ),
        unexplained_share=left,
        proposed_motion=found.proposed if accepted and not outside else None,
        warnings=_warnings(found, outside, left),
    )


def _effect(key: str) -> str:
    return key.split("@")[0]


def _cause(found: Findings, key: str) -> Cause:
    search = found.search
    candidate = search.sketch.candidate(key)
    estimates = dict(found.estimates.get(key, {}))
    for name, value in search.fit.model[candidate.effect.name].items():
        # Fixed parameters that belong to it, as the place of a patch.
        parameter = next((p for p in candidate.effect.parameters if p.name == name), None)
        others = [c for c in search.fit.candidates if c.effect is candidate.effect]
        if name not in estimates and parameter is not None and len(others) == 1:
            known = (float(value), float(value))
            if any(p.name == name for p in candidate.free):
                # Fitted, but interrupted before anything was known of how well.
                known = (parameter.lower, parameter.upper)
            estimates[name] = Estimate(float(value), parameter.unit, known)
    return Cause(
        candidate.effect.name,
        candidate.site,
        estimates,
        found.gains.get(key, 0.0),
        tuple(found.rivals.get(key, ())),
    )


def _looks_like(accepted: tuple[str, ...], left: float | None) -> str:
    names = ", ".join(accepted)
    if left is None or left > 0.5:
        return f"A part of it looks like {names}, too little to be called the cause."
    return (
        f"{100 * (1.0 - left):.0f} % of it looks like {names}. That is not called the cause, since "
        "what it leaves has order: something that the library lacks may do nearly the same. "
        f"--may-stay {math.ceil(100 * left) / 100:g} would name it all the same."
    )


def _warnings(found: Findings, outside: bool, left: float | None) -> tuple[str, ...]:
    sentences = []
    if not found.complete:
        sentences.append("The diagnosis was interrupted; what it had found by then is reported.")
    if outside:
        where = ", ".join(found.left.sensors)
        sentences.append(f"Something that no known effect explains is left in: {where}.")
        if found.search.accepted():
            sentences.append(_looks_like(found.search.accepted(), left))
    elif found.search.accepted() and found.left.sensors:
        where = ", ".join(found.left.sensors)
        sentences.append(
            f"What is left in {where} is not without order: something that no known effect "
            "explains may add to what is named, or what is named may stand in for it."
        )
    for key in found.unseen:
        sentences.append(
            f"{key} changes nothing that was measured in these motions, so nothing can be said "
            "about it."
        )
    return (*sentences, *found.remarks)
