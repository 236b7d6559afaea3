"""What should be done next where data cannot tell a few causes apart."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from defras_bt.diagnosis.fitted import Fit, model_without
from defras_bt.diagnosis.motions import Planning, separating_motions
from defras_bt.diagnosis.noise import Noise
from defras_bt.diagnosis.search import Search

_TELLS = 3.0
"""Standard deviations of the noise between two causes from which on a motion tells them apart."""


def proposed_motion(search: Search, rivals: Mapping[str, Mapping[str, Fit]]) -> str | None:
    """In a sentence, the safe motion that would best tell an accepted cause from its ``rivals``,
    by its key those of other effects with their fits. Of several such causes the first is asked
    about. None where there is no rival, or the problem knows of no motions."""
    problem = search.counted.problem
    asked = next((key for key, fits in rivals.items() if fits), None)
    if asked is None or not isinstance(problem, Planning):
        return None
    return _told(search, problem, asked, rivals[asked])


def _told(search: Search, problem: Planning, key: str, rivals: Mapping[str, Fit]) -> str:
    strengths = {key: search.fit.values_of(key)}
    strengths |= {rival: fit.values_of(rival) for rival, fit in rivals.items()}
    model, limit_n = model_without(search.fit, key), problem.force_limit_n
    motions = problem.planned_motions(model, strengths, search.rng)
    share = _independent_share(search.noise)
    safe = separating_motions(motions, model, strengths, limit_n, share)
    names = ", ".join(strengths)
    if not safe:
        return (
            f"None: all {len(motions)} motions that were tried on the model would need more force "
            f"than the {limit_n:.2g} N allowed; {names} cannot be told apart safely."
        )
    best = safe[0]
    apart = f"{best.separation:.1f} standard deviations of the noise"
    force = f"with {best.motion.peak_force_n:.2g} N at most ({limit_n:.2g} N are allowed)"
    if best.separation < _TELLS:
        return (
            f"None is sure to tell {names} apart. Of the motions below {limit_n:.2g} N the best is "
            f"to {best.motion.sentence}, which sets them {apart} apart, {force}."
        )
    said = f"{best.motion.sentence[0].upper()}{best.motion.sentence[1:]}"
    return f"{said}: that should set {names} at least {apart} apart, {force}."


def _independent_share(noise: Noise) -> float:
    """How many independent samples a sample is worth to a slow change: the variance of white noise
    over that of the mean of this one (Bartlett 1946), the middle of all channels."""
    worth = [
        (channel.sd * (1.0 - float(channel.ar.sum())) / channel.innovation_sd) ** 2
        for channel in noise.channels
        if channel.innovation_sd > 0.0
    ]
    return float(np.clip(np.median(worth), 0.0, 1.0)) if worth else 1.0
