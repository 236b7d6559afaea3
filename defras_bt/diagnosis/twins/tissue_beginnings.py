"""Where effects begin that are not there yet: how strong, since when, at how many places."""

from __future__ import annotations

from defras_bt.diagnosis.problem import Candidate
from defras_sim.effects.effect import EffectParameter, Extension

LATE_STEPS = (1.0, 3.0)
"""Of a delay's step: late frames are not on a straight line for long."""
SLACK = {"joint_play": (1.0, 3.0)}
"""Effects without a derivative at their null point, and of how many steps of theirs to try."""
ONSET = {"grasp_slip": "time_s", "attachment_tear": "time_s"}
"""Effects that begin during the motion, and the parameter that says when."""
ONSETS, FINE_ONSETS = 4, 16
"""Times at which such an effect may begin: of derivatives, and of what is led along in full, which
is as easily begun at many times as at few."""
STRONG = {
    "attachment_tear": 1.0,
    "bed_adhesion": 20.0,
    "extra_attachment": 0.9,
    "inclusion": 4.0,
    "missing_attachment": 1.0,
}
"""Effects whose beginning says little of how they end: a soft spring under tissue that is lifted
far pulls ever more, a firm one holds it; tissue that sticks a little is soon off. The strength at
which they are tried in full; those of a place where they explain the residual best."""
PLACES_TRIED = 2
PROMISING = 0.02
"""Share of the residual's squares that a place has to explain to be tried in full."""


def inwards(p: EffectParameter, value: float) -> float:
    """The parameter's step, turned round where it would leave the bounds."""
    return p.step if value + p.step <= p.upper else -p.step


def standing(model: Extension, candidate: Candidate) -> dict[str, float]:
    """Where the candidate's free parameters stand in ``model``."""
    values = model.get(candidate.effect.name, {})
    return {p.name: float(values.get(p.name, p.null)) for p in candidate.free}


def is_there(model: Extension, candidate: Candidate) -> bool:
    """Whether ``model`` has the candidate already."""
    values = model.get(candidate.effect.name, {})
    return any(values.get(p.name, p.null) != p.null for p in candidate.free if p.strength)
