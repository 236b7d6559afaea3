"""Motions that could be made next: other retractions with what was recorded, about as far.

They go no higher than the recorded ones and stay near where tissue was taken: what was done once
may be done again, and the twin has been compared there.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from defras_bt.diagnosis.twins.tissue_trajectory import Trajectory
from defras_sim.geometry import Floats, Pose
from defras_sim.motion import away_from_endoscope
from defras_sim.recorded_motion import ArmMotion, RecordedMotion
from defras_sim.scene import Scene

_PERIOD_S = 0.1
_REST_S, _HOLD_S, _LONG_S = 0.5, 1.0, 5.0
_LOWEST_M, _HIGHEST_M = 0.01, 0.04
_TO_AND_FRO_M = 0.012
_FAST, _SLOW = 3.0, 0.4
"""Of the speed with which tissue is moved."""
_APART_M = 0.025
"""Between the recorded grasp and another one at which as much is asked of other tissue."""


@dataclass(frozen=True)
class Leg:
    """A stretch of a plan: to a place (3,) beside where the tissue was taken, at a speed, and a
    pause there."""

    to_m: Floats
    speed_m_s: float
    pause_s: float = _HOLD_S


@dataclass(frozen=True)
class Plan:
    """``sentence`` begins with what the arm would be told to do, in the infinitive."""

    sentence: str
    motion: RecordedMotion


def plans(scene: Scene, trajectories: Sequence[Trajectory]) -> list[Plan]:
    """Motions for the first grip of each arm in ``trajectories``, each about 10 s long."""
    found: list[Plan] = []
    done: set[str] = set()
    for each in trajectories:
        highest = max(float(each.height_m.max(initial=0.0)), _LOWEST_M)
        for name, arm in each.motion.arms.items():
            taken = np.flatnonzero(arm.grasped)
            if len(taken) == 0 or name in done:
                continue
            done.add(name)
            found += _for_grip(scene, each.motion, name, int(taken[0]), min(highest, _HIGHEST_M))
    return found


def _for_grip(
    scene: Scene, motion: RecordedMotion, name: str, row: int, lift_m: float
) -> Iterator[Plan]:
    """Plans that take the tissue where arm ``name`` took it at instant ``row`` of ``motion``, or
    beside; the other arms stand where they stood then, with open jaws."""
    speed = scene.motion.tissue_speed_m_s
    up, half = (np.array([0.0, 0.0, share * lift_m]) for share in (1.0, 0.5))
    over = up + min(_TO_AND_FRO_M, lift_m) * away_from_endoscope(scene)
    tips = motion.tips(row)
    at_m = tips[name].position_m
    lift_mm = 1e3 * lift_m
    take = f"let {name.upper()} take the tissue where it was taken, lift it by {lift_mm:.0f} mm"

    def plan(sentence: str, legs: Sequence[Leg], beside_m: Floats | None = None) -> Plan:
        taken = tips[name] if beside_m is None else tips[name].moved(beside_m)
        return Plan(sentence, _led({**tips, name: taken}, name, legs))

    yield plan(f"{take} quickly and hold it for {_LONG_S:.0f} s", [Leg(up, _FAST * speed, _LONG_S)])
    yield plan(
        f"{take} slowly, lower it halfway, and lift it to the same height again",
        [Leg(up, speed, 0.5), Leg(half, speed, 0.5), Leg(up, speed, 0.5)],
    )
    for axis, words in ((0, "along the tissue's x axis"), (1, "along its y axis")):
        aside = np.zeros(3)
        aside[axis] = min(_TO_AND_FRO_M, lift_m)
        yield plan(
            f"{take} and move it to and fro by {1e3 * aside[axis]:.0f} mm {words}",
            [Leg(up, speed, 0.5)]
            + [Leg(up + sign * aside, speed, 0.3) for sign in (1.0, -1.0, 1.0)],
        )
    yield plan(
        f"{take}, fold it away from the camera and back, at first slowly, then quickly",
        [Leg(up, speed, 0.5)]
        + [Leg(place, share * speed, 0.3) for share in (_SLOW, _FAST) for place in (over, up)],
    )
    beside_m = _inwards(at_m)
    yield plan(
        f"let {name.upper()} take the tissue {1e3 * _APART_M:.0f} mm nearer to its middle, lift it "
        f"by {lift_mm:.0f} mm and hold it",
        [Leg(up, speed)],
        beside_m,
    )


def _inwards(place_m: Floats) -> Floats:
    """A way (3,) of :data:`_APART_M` from a place to the middle of the tissue, along it."""
    way = -np.array([place_m[0], place_m[1], 0.0])
    length = float(np.linalg.norm(way))
    return way / length * _APART_M if length > _APART_M else np.array([0.0, 0.0, 0.0])


def _led(tips: Mapping[str, Pose], name: str, legs: Sequence[Leg]) -> RecordedMotion:
    """The motion of arms that stand at ``tips`` (tissue_from_tip), of which ``name`` takes tissue
    there and follows ``legs``."""
    at_m = tips[name].position_m
    places = [at_m] * round(_REST_S / _PERIOD_S)
    taken = len(places) - 1
    here = at_m
    for leg in legs:
        there = at_m + leg.to_m
        length = float(np.linalg.norm(there - here))
        steps = max(1, round(length / (leg.speed_m_s * _PERIOD_S)))
        places += [here + (there - here) * (k + 1) / steps for k in range(steps)]
        places += [there] * round(leg.pause_s / _PERIOD_S)
        here = there
    count = len(places)

    def arm(own: str, tip: Pose) -> ArmMotion:
        path = np.stack(places) if own == name else np.tile(tip.position_m, (count, 1))
        holds = (np.arange(count) >= taken) & (own == name)
        return ArmMotion(path, np.tile(tip.rotation, (count, 1, 1)), holds)

    time_s = np.linspace(0.0, _PERIOD_S * (count - 1), count)
    return RecordedMotion(time_s, {own: arm(own, tip) for own, tip in tips.items()})
