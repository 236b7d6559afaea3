"""Where an arm's set-point must have come to, from what was commanded."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import hypot

from defras_sim.geometry import Floats, Pose

# Of three numbers, arrays are slower.
_Vector = tuple[float, float, float]
_NOWHERE: _Vector = (0.0, 0.0, 0.0)

STRAYED_M = 0.004
"""Farther than this from where the commands lead, a set-point did not advance as commanded: more
than one and a half ticks at full speed, so that a command that takes effect a tick late is none."""
ALLOWED_SHARE = 0.1
"""This share of the way an arm may go differently, for good: the time for which a real arm carries
out a command is not exact. A share of the way, not of time, so that however slowly an arm is told
to go, it is found out after the same few millimetres."""
# Readings older than this are refused as stale long before.
_KEPT_S = 10.0


@dataclass(frozen=True)
class _Leg:
    """One command's motion from ``start_s`` on; ``before_m``, ``way_before_m``: the sum up to
    there, ``step_m``: its own part, evenly over ``tick_s``."""

    start_s: float
    tick_s: float
    before_m: _Vector
    way_before_m: float
    step_m: _Vector

    def at(self, time_s: float) -> tuple[_Vector, float]:
        """Displacement and length of the way, both in metres, up to ``time_s``."""
        share = min(max((time_s - self.start_s) / self.tick_s, 0.0), 1.0)
        way_m = share * hypot(*self.step_m)
        return _sum(self.before_m, self.step_m, share), self.way_before_m + way_m


class DeadReckoning:
    """Follows one arm's set-point by what was sent, and tells how far a reading is from there.

    The first reading is believed. From then on only commands lead on; readings draw the reckoning
    to themselves by ``ALLOWED_SHARE`` of the way and no more.
    """

    def __init__(self) -> None:
        self._legs: deque[_Leg] = deque()
        self._start_m: _Vector | None = None
        self._way_m = 0.0

    def sent(self, time_s: float, linear_m_s: Floats, tick_s: float) -> None:
        """The tip is told to go at ``linear_m_s`` (3,) from ``time_s`` on, for ``tick_s``."""
        velocity_m_s = _vector(linear_m_s)
        if velocity_m_s == _NOWHERE:
            return
        before_m, way_m, start_s = _NOWHERE, 0.0, time_s
        if self._legs:
            last = self._legs[-1]
            start_s = max(time_s, last.start_s + last.tick_s)
            before_m, way_m = last.at(start_s)
        step_m = _sum(_NOWHERE, velocity_m_s, tick_s)
        self._legs.append(_Leg(start_s, tick_s, before_m, way_m, step_m))
        while self._legs[0].start_s < time_s - _KEPT_S:
            self._legs.popleft()

    def forget(self) -> None:
        """Believe the next reading as if it were the first."""
        self._start_m = None

    def gave_up(self, way_m: Floats) -> None:
        """This part (3,) of what was sent will not be gone: who drives the arm gave it up."""
        if self._start_m is not None:
            self._start_m = _sum(self._start_m, _vector(way_m), -1.0)

    def strayed_m(self, stamp_s: float, setpoint: Pose) -> float:
        """How far ``setpoint`` (tissue_from_tip), read at ``stamp_s``, is from where commands led.

        0 for the first reading.
        """
        sent_m, way_m = self._sent_until(stamp_s)
        gone_m = _sum(_vector(setpoint.position_m), sent_m, -1.0)
        if self._start_m is None:
            self._start_m, self._way_m = gone_m, way_m
            return 0.0
        allowed_m = ALLOWED_SHARE * max(0.0, way_m - self._way_m)
        self._way_m = max(way_m, self._way_m)
        apart_m = _sum(gone_m, self._start_m, -1.0)
        astray_m = _sum(_NOWHERE, apart_m, _share_left(hypot(*apart_m), allowed_m))
        self._start_m = _sum(gone_m, astray_m, -1.0)
        return hypot(*astray_m)

    def _sent_until(self, time_s: float) -> tuple[_Vector, float]:
        for leg in reversed(self._legs):
            if leg.start_s <= time_s:
                return leg.at(time_s)
        return self._legs[0].at(time_s) if self._legs else (_NOWHERE, 0.0)


def shortened(vector_m: Floats, by_m: float) -> Floats:
    """``vector_m`` (3,) shorter by ``by_m``; zero where it was no longer than that.

    >>> import numpy as np
    >>> shortened(np.array([0.0, 0.0, 4.0]), 1.0)
    array([0., 0., 3.])
    """
    return vector_m * _share_left(hypot(*vector_m.tolist()), by_m)


def _share_left(length_m: float, by_m: float) -> float:
    return 1.0 - by_m / length_m if length_m > by_m else 0.0


def _vector(values: Floats) -> _Vector:
    x, y, z = values.tolist()
    return x, y, z


def _sum(a: _Vector, b: _Vector, times: float) -> _Vector:
    """``a`` and ``b``, the latter so many times."""
    return a[0] + times * b[0], a[1] + times * b[1], a[2] + times * b[2]
