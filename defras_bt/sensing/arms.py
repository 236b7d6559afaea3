"""Whether the arms are where they were told to be, and where they can have come to."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from math import dist, isfinite
from typing import NamedTuple

from defras_bt.sensing.dead_reckoning import STRAYED_M, DeadReckoning
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.worlds.protocol import ArmObservation, Command, Observation

FOLLOWING_M = 0.003
"""Farther than this from its set-point, a tip does not follow: three times a dVRK's usual error,
sixty times that of the arms in PyBullet at full speed."""
JUMP_M = 0.002
"""A tip may be this much farther on than its speed explains: noise, and the roundness of stamps."""


class _Place(NamedTuple):
    """Where an arm's tip and its set-point were, in metres: of three numbers, arrays are slower."""

    stamp_s: float
    tip_m: list[float]
    setpoint_m: list[float]

    @property
    def is_sound(self) -> bool:
        return isfinite(self.stamp_s) and all(map(isfinite, self.tip_m + self.setpoint_m))

    def moved_m(self, other: _Place) -> float:
        """The larger way of tip and set-point between two readings."""
        return max(dist(self.tip_m, other.tip_m), dist(self.setpoint_m, other.setpoint_m))


class ArmPlausibility:
    """Finds readings of arms that are well-formed and still cannot be acted on.

    A tip that left its set-point (a blocked or switched-off arm) is unsound as long as it is away.
    A tip or set-point that jumped (a slipped encoder, another frame) is unsound until it is back
    where it was lost: where it really is, nobody knows. A set-point that does not go where the
    commands lead is unsound until it is there: either the arm does not hear, or its driver repeats
    an old message as if it were new while the arm moves on. After the operator drove the arms
    themselves, or the world itself stopped one, where its set-point stands is believed anew.
    """

    def __init__(self, scene: Scene) -> None:
        self._speed_m_s = scene.motion.reach_speed_m_s
        self._last: dict[str, _Place] = {}
        self._lost: dict[str, _Place] = {}
        self._tick_s = scene.tick_s
        self._reckoned: defaultdict[str, DeadReckoning] = defaultdict(DeadReckoning)
        self._goals_m: dict[str, Floats] = {}

    def sent(self, time_s: float, command: Command) -> None:
        """``command`` was sent for the tick that begins at ``time_s``; call it once per tick."""
        for name, arm in command.arms.items():
            self._reckoned[name].sent(time_s, arm.linear_m_s, self._tick_s)
            if name in self._goals_m:
                self._goals_m[name] = self._goals_m[name] + arm.linear_m_s * self._tick_s

    def faults(self, observation: Observation, *, driven_by_hand: bool) -> Mapping[str, str]:
        """A sentence for each arm that must not be acted on; call it once per tick."""
        found: dict[str, str] = {}
        for name, arm in observation.arms.items():
            place = _place(arm)
            if not place.is_sound:
                continue  # freshness says so already
            jumped_m = 0.0 if driven_by_hand else self._jump_m(name, place)
            if driven_by_hand:
                self._lost.pop(name, None)
            self._last[name] = place
            self._note_goal(name, arm)
            away_m = dist(place.tip_m, place.setpoint_m)
            stopped = driven_by_hand or name in observation.stopped
            if stopped or away_m > FOLLOWING_M:
                # A driver may take the set-point back to a tip that was held up.
                self._reckoned[name].forget()
                strayed_m = 0.0
            else:
                strayed_m = self._reckoned[name].strayed_m(
                    arm.stamp_s, arm.setpoint_tissue_from_tip
                )
            if away_m > FOLLOWING_M:
                found[name] = (
                    f"{name} does not follow: its tip is {away_m * 1e3:.1f} mm away from where it "
                    f"was told to be, at most {FOLLOWING_M * 1e3:g} mm are allowed"
                )
            elif jumped_m > 0.0:
                found[name] = (
                    f"{name} is {jumped_m * 1e3:.1f} mm away from where it can be: its position "
                    "jumped and is not believed until it is back"
                )
            elif strayed_m > STRAYED_M:
                found[name] = (
                    f"{name} does not follow: its set-point is {strayed_m * 1e3:.1f} mm away from "
                    f"where the commands lead, at most {STRAYED_M * 1e3:g} mm are allowed"
                )
        return found

    def _note_goal(self, name: str, arm: ArmObservation) -> None:
        """A stream that hears from a slow tree too late ends the motion, and gives up the rest of
        its way: then its goal is not where all commands together led."""
        led_m = self._goals_m.pop(name, None)
        goal = arm.goal_tissue_from_tip
        if goal is None or not all(map(isfinite, goal.position_m.tolist())):
            return
        goal_m = self._goals_m[name] = goal.position_m
        if led_m is not None:
            self._reckoned[name].gave_up(led_m - goal_m)

    def _jump_m(self, name: str, now: _Place) -> float:
        """How far an arm is from where it was lost; 0 while it is not lost."""
        if name in self._lost:
            away_m = self._lost[name].moved_m(now)
            if away_m > JUMP_M:
                return away_m
            del self._lost[name]
            return 0.0
        last = self._last.get(name)
        if last is None:
            return 0.0
        most_m = JUMP_M + self._speed_m_s * max(0.0, now.stamp_s - last.stamp_s)
        moved_m = last.moved_m(now)
        if moved_m <= most_m:
            return 0.0
        self._lost[name] = last
        return moved_m


def _place(arm: ArmObservation) -> _Place:
    tip, setpoint = arm.tissue_from_tip, arm.setpoint_tissue_from_tip
    return _Place(arm.stamp_s, tip.position_m.tolist(), setpoint.position_m.tolist())
