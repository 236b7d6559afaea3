"""The first joint that a motion brings beyond its limits, in one compiled call for every tick."""

from __future__ import annotations

from defras_sim.arm.closed_form import jit, joints_and_whether, turned_back
from defras_sim.arm.dh import JOINT_NAMES
from defras_sim.geometry import Floats

NONE, UNDETERMINED = -1, -2
"""No joint; and: at the start or at the end the joints are not determined."""
_ROLL = JOINT_NAMES.index("roll")


@jit
def broken_joint(
    start_turn: Floats,
    start_m: Floats,
    end_turn: Floats,
    end_m: Floats,
    low: Floats,
    high: Floats,
    speed: Floats,
    time_s: float,
) -> tuple[int, bool, float, float]:
    """Which joint breaks a limit, whether by its speed, and where it starts and would end.

    Poses of the tip from the remote centre as rotation (3, 3) and position (3,); ``low``, ``high``,
    ``speed`` (6,). A joint that is outside already may only go back. Ranges come before speeds.
    """
    start, at_start = joints_and_whether(start_turn, start_m)
    end, at_end = joints_and_whether(end_turn, end_m)
    if not (at_start and at_end):
        return UNDETERMINED, False, 0.0, 0.0
    for j in range(len(end)):
        change = end[j] - start[j]
        if j == _ROLL:
            change = turned_back(change)
        if (end[j] > high[j] and change > 0.0) or (end[j] < low[j] and change < 0.0):
            return j, False, start[j], end[j]
    for j in range(len(end)):
        change = end[j] - start[j]
        if j == _ROLL:
            change = turned_back(change)
        if abs(change) > speed[j] * time_s:
            return j, True, start[j], end[j]
    return NONE, False, 0.0, 0.0
