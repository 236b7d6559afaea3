"""A scripted safe retraction: what a diagnosis is shown, without an executive that could react.

Up, hold, sideways, hold, over, hold, and all the way back: every direction is passed both ways, so
that slack, lag and hysteresis show, and every hold is long enough for what fades.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.motion import away_from_endoscope
from defras_sim.scene import ArmName, GraspPoint, Scene
from defras_sim.worlds.protocol import JAW_CLOSED_RAD, JAW_OPEN_RAD, ArmCommand, Command, World

_CLEARANCE_M = 0.02
_ARRIVED_M = 1e-6
_JAW_S = 0.3


@dataclass(frozen=True)
class Script:
    """One retraction of ``arm`` at ``point``: heights and ways in m, speed in m/s, holds in s."""

    arm: ArmName
    point: GraspPoint
    lift_m: float
    move_m: tuple[float, float]
    fold_m: float
    speed_m_s: float
    hold_s: float
    rest_s: float = 1.5

    @staticmethod
    def drawn(scene: Scene, point: GraspPoint, arm: ArmName, rng: np.random.Generator) -> Script:
        """Ways and speed around the usual ones, the move towards the middle of the tissue."""
        inwards = -scene.grasp_xy_m(*point)
        inwards /= max(float(np.linalg.norm(inwards)), 1e-9)
        across = np.array([-inwards[1], inwards[0]]) * rng.uniform(-0.5, 0.5)
        way = rng.uniform(0.012, 0.02) * (inwards + across)
        return Script(
            arm,
            point,
            lift_m=float(rng.uniform(0.025, 0.032)),
            move_m=(float(way[0]), float(way[1])),
            fold_m=float(rng.uniform(0.012, 0.02)),
            speed_m_s=float(rng.uniform(0.018, 0.024)),
            hold_s=float(rng.uniform(0.9, 1.2)),
        )

    def commands(self, scene: Scene, world: World) -> Iterator[Command]:
        """A command per tick, to be carried out before the next one is asked for."""
        start = scene.grasp_point_m(*self.point)
        up = start + np.array([0.0, 0.0, self.lift_m])
        moved = up + np.array([*self.move_m, 0.0])
        over = moved + self.fold_m * away_from_endoscope(scene)
        fast = scene.motion.reach_speed_m_s
        yield from self._wait(self.rest_s, world)
        yield from self._go(start + np.array([0.0, 0.0, _CLEARANCE_M]), fast, world)
        yield from self._jaw(JAW_OPEN_RAD, world)
        yield from self._go(start, fast, world)
        yield from self._jaw(JAW_CLOSED_RAD, world)
        for place in (up, moved, over, moved, up):
            yield from self._go(place, self.speed_m_s, world)
            yield from self._wait(self.hold_s, world)
        yield from self._go(start, self.speed_m_s, world)
        yield from self._jaw(JAW_OPEN_RAD, world)
        yield from self._wait(2.0, world)

    def _go(self, goal_m: Floats, speed_m_s: float, world: World) -> Iterator[Command]:
        while True:
            here = world.observe().arms[self.arm].setpoint_tissue_from_tip.position_m
            way = goal_m - here
            distance = float(np.linalg.norm(way))
            if distance < _ARRIVED_M:
                return
            speed = min(speed_m_s, distance / world.tick_s)
            yield Command({self.arm: ArmCommand(linear_m_s=way / distance * speed)})

    def _jaw(self, goal_rad: float, world: World) -> Iterator[Command]:
        for _ in range(round(_JAW_S / world.tick_s)):
            yield Command({self.arm: ArmCommand(jaw_rad=goal_rad)})

    def _wait(self, time_s: float, world: World) -> Iterator[Command]:
        for _ in range(round(time_s / world.tick_s)):
            yield Command()
