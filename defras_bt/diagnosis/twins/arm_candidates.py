"""What may be wrong with the joints of an arm, given how they were moved."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from defras_bt.diagnosis.problem import Candidate
from defras_sim.effects.arm_joints import JOINTS, WRIST, JointName
from defras_sim.effects.effect import Effect, Values
from defras_sim.effects.joint_coupling import EFFECT as JOINT_COUPLING
from defras_sim.effects.joint_coupling import coupling_name
from defras_sim.effects.joint_offset import EFFECT as JOINT_OFFSET
from defras_sim.effects.joint_play import EFFECT as JOINT_PLAY
from defras_sim.effects.joint_play import drag_name, share_name, width_name
from defras_sim.effects.servo_lag import EFFECT as SERVO_LAG
from defras_sim.geometry import Floats

_WIDTHS = np.geomspace(0.01, 0.6, 14)
"""Of play that is looked for, as shares of the range of the joint: each 1.4 times the last."""

_LAGS_S = np.geomspace(0.01, 0.32, 11)
"""That are looked for, each 1.4 times the last: what a lag of several rows does is not what the
derivative at zero says."""

_ARM: tuple[JointName, ...] = tuple(q for q in JOINTS if q not in WRIST)


def joint_candidates(
    setpoints: Sequence[Floats], measured: Sequence[JointName]
) -> tuple[Candidate, ...]:
    """Causes for errors of the ``measured`` joints in runs with ``setpoints`` (rows, 6) each.

    A joint that never moved can show no lag and no play, and moves no other joint along.
    """
    moving = tuple(q for q, width in zip(JOINTS, _ranges(setpoints), strict=True) if width > 0)
    found: list[Candidate] = []
    for joint in measured:
        index = JOINTS.index(joint)
        # What every calibration leaves; it would explain a little of everything.
        found.append(
            Candidate(JOINT_OFFSET, (JOINT_OFFSET.parameters[index],), joint, nuisance=True)
        )
        if joint in moving:
            found.append(Candidate(SERVO_LAG, (SERVO_LAG.parameters[index],), joint))
            found.append(_play(joint, measured))
        # Cables to the wrist pass the first three joints; nothing leads from the wrist to them.
        for group in (_ARM, WRIST) if joint in WRIST else (_ARM,):
            sources = [by for by in group if by in moving]
            if sources:
                names = [coupling_name(joint, by) for by in sources]
                found.append(_candidate(JOINT_COUPLING, names, f"{joint}<-{','.join(sources)}"))
    return tuple(found)


def play_starts(
    setpoints: Sequence[Floats], candidate: Candidate
) -> list[tuple[Values, list[Values]]]:
    """Widths of play to try: as a free gap, and with any share of what is lost of the width."""
    joint = next(q for q in JOINTS if q == candidate.site)
    width_range = _ranges(setpoints)[JOINTS.index(joint)]
    width = candidate.free[0]
    shares = [p.name for p in candidate.free[1:]]
    starts: list[tuple[Values, list[Values]]] = []
    for tried in _WIDTHS * width_range:
        w = float(tried)
        if width.lower < w <= width.upper:
            starts.append(({}, [{width.name: w}]))
            nothing = dict.fromkeys(shares, 0.0)
            starts.append(({width.name: w, **nothing}, [{share: 1.0} for share in shares]))
    return starts


def lag_starts(candidate: Candidate) -> list[tuple[Values, list[Values]]]:
    """Lags to try."""
    return [({}, [{candidate.free[0].name: float(lag_s)}]) for lag_s in _LAGS_S]


def _play(joint: JointName, measured: Sequence[JointName]) -> Candidate:
    dragged = [q for q in WRIST if joint in WRIST and q != joint and q in measured]
    names = [width_name(joint), share_name(joint), *(drag_name(q, joint) for q in dragged)]
    return _candidate(JOINT_PLAY, names, joint)


def _candidate(effect: Effect, names: Sequence[str], site: str) -> Candidate:
    by_name = {p.name: p for p in effect.parameters}
    return Candidate(effect, tuple(by_name[name] for name in names), site)


def _ranges(setpoints: Sequence[Floats]) -> Floats:
    """How far each joint moves (6,)."""
    together = np.concatenate(setpoints)
    return np.asarray(together.max(axis=0) - together.min(axis=0), float)
