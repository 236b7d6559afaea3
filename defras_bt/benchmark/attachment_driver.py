"""Leads one arm through a case, the twin and monitoring beside it, until an update is asked for."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from defras_bt.benchmark.attachment_cases import UpdateCase
from defras_bt.learning.buffer import KeyframeBuffer
from defras_bt.learning.estimate import Keyframe
from defras_bt.monitoring.rest import RestCalibration
from defras_bt.monitoring.warning import WarningMonitor
from defras_bt.sensing.sense import SensedObservation, sense
from defras_sim.geometry import Floats, Pose
from defras_sim.motion import manoeuvre_target_m
from defras_sim.scene import Scene
from defras_sim.surface import Surface
from defras_sim.twin import Mask, Twin
from defras_sim.worlds.protocol import (
    HOLD,
    JAW_CLOSED_RAD,
    JAW_OPEN_RAD,
    ArmCommand,
    Command,
    Observation,
    World,
)

REACHED_M = 1e-4
"""A target is reached where the set-point is nearer than that."""

_MOST_TICKS = 600
_FEWEST_FRAMES = 3
_SETTLING_TICKS = 6
"""Ticks of holding still before an update: a dynamic world comes to rest."""


@dataclass(frozen=True)
class Asked:
    """An update that is asked for.

    ``belief`` is the scene that the twin runs with; ``calibration`` by metric what rest looked
    like; ``true_surface`` and ``true_force_n`` are the world's own.
    """

    belief: Scene
    keyframes: Sequence[Keyframe]
    calibration: Mapping[str, RestCalibration]
    mu_m: Mapping[str, float]
    true_surface: Surface
    true_force_n: float
    time_s: float


class Driver:
    """Leads the arm of ``case`` through ``world``, and the twin of ``believed`` beside it.

    ``planned_m``: targets (3,) of the planned motion that were not reached yet.
    """

    def __init__(self, case: UpdateCase, world: World, believed: Scene) -> None:
        self._case, self._world, self._believed = case, world, believed
        self._twin, self._monitor = Twin(believed), WarningMonitor(believed)
        self._keyframes = KeyframeBuffer()
        self._mu_m: Mapping[str, float] = {}
        self.planned_m: tuple[Floats, ...] = ()

    def run(self) -> Asked | None:
        """None where the motion ends before any warning, or the model or a grasp fails."""
        if not (self._rest() and self._grasp()):
            return None
        self.planned_m = self._targets()
        still = 0
        while self.planned_m:
            if self._world.time_s > _MOST_TICKS * self._world.tick_s:
                return None
            way_m = self.planned_m[0] - self.tip_m
            if still or self._warned():
                if still == _SETTLING_TICKS and self._warned():
                    return self.asked()
                # A warning that passes as the tissue comes to rest asks for nothing.
                still = (still + 1) % (_SETTLING_TICKS + 1)
                way_m = np.zeros(3)
            elif np.linalg.norm(way_m) < REACHED_M:
                self.planned_m = self.planned_m[1:]
                continue
            if not self.go(way_m, self._believed.motion.tissue_speed_m_s):
                return None
        return None

    @property
    def tip_m(self) -> Floats:
        """Where the set-point of the arm's tip is (3,)."""
        return self._setpoints()[self._case.arm].position_m

    @property
    def tick_s(self) -> float:
        return self._world.tick_s

    @property
    def scene(self) -> Scene:
        """What the twin believes now."""
        return self._twin.scene

    @property
    def true_force_n(self) -> float | None:
        """The world's own largest grasp force."""
        return self._world.true_force_n()

    @property
    def holds(self) -> bool:
        """Whether the arm really has the tissue."""
        return bool(self._world.observe().arms[self._case.arm].grasped)

    def believe(self, attached: Mask) -> None:
        """Take over ``attached`` (holes,), as the executive does with an estimate."""
        self._twin.set_attached(attached)
        self._monitor.twin_changed()

    def go(self, way_m: Floats, speed_m_s: float) -> bool:
        """One tick along ``way_m`` (3,), at most to its end; False where the twin is lost."""
        most_m = speed_m_s * self._world.tick_s
        share = min(1.0, most_m / max(float(np.linalg.norm(way_m)), most_m))
        self._step(way_m * share / self._world.tick_s)
        return self._twin.state.converged

    def asked(self) -> Asked | None:
        """What is known now; None where the world does not tell what is true."""
        surface, force_n = self._world.true_surface(), self._world.true_force_n()
        if surface is None or force_n is None:
            return None
        return Asked(
            belief=self._twin.scene,
            keyframes=self._keyframes.frames(),
            calibration=self._monitor.calibration,
            mu_m=self._mu_m,
            true_surface=surface,
            true_force_n=force_n,
            time_s=self._world.time_s,
        )

    def _rest(self) -> bool:
        for _ in range(_MOST_TICKS):
            sensed = self._sensed()
            if self._monitor.observe_rest(sensed.cloud, self._twin.state.surface):
                return True
            self._advance(HOLD)
        return False

    def _grasp(self) -> bool:
        """Open and close the jaws of all arms that take tissue."""
        second = self._case.second_tool
        arms: list[str] = [self._case.arm, *([second.arm] if second else [])]
        for jaw_rad in (JAW_OPEN_RAD, JAW_CLOSED_RAD):
            for _ in range(_MOST_TICKS):
                seen = self._world.observe().arms
                if all(
                    abs(seen[a].jaw_rad - jaw_rad) < 1e-3 or (jaw_rad == 0.0 and seen[a].grasped)
                    for a in arms
                ):
                    break
                self._advance(Command({arm: ArmCommand(jaw_rad=jaw_rad) for arm in arms}))
        if not self._world.observe().arms[self._case.arm].grasped:
            return False
        setpoint = self._setpoints()[self._case.arm]
        self._twin.grasp(self._case.arm, setpoint, self._world.time_s)
        return True

    def _targets(self) -> tuple[Floats, ...]:
        targets, tip_m = [], self.tip_m
        for manoeuvre in self._case.manoeuvres:
            tip_m = manoeuvre_target_m(self._believed, manoeuvre, tip_m)
            targets.append(tip_m)
        return tuple(targets)

    def _step(self, velocity_m_s: Floats) -> None:
        """Move, look, track and compare."""
        commands: dict[str, ArmCommand] = {self._case.arm: ArmCommand(linear_m_s=velocity_m_s)}
        second = self._case.second_tool
        if second is not None and velocity_m_s.any():
            commands[second.arm] = ArmCommand(linear_m_s=np.array(second.velocity_m_s))
        self._advance(Command(commands))
        sensed = self._sensed()
        state = self._twin.track(self._setpoints(), sensed.time_s)
        if not state.converged:
            return
        reading = self._monitor.reading(sensed.cloud, state.surface, sensed.time_s)
        self._mu_m = reading.mu_m
        self._keyframes.add(sensed.time_s, self._twin.taken, self._twin.jaws, sensed.cloud)

    def _warned(self) -> bool:
        limit_m = self._believed.thresholds.delta_m[self._case.state - 1]
        enough = len(self._keyframes.frames()) >= _FEWEST_FRAMES
        return enough and self._mu_m.get("local", 0.0) > limit_m

    def _advance(self, command: Command) -> None:
        self._world.command(command)
        self._world.step()

    def _sensed(self) -> SensedObservation:
        """What is sensed, without arms that nobody knows of."""
        seen: Observation = self._world.observe()
        believed: Collection[str] = self._believed.arms
        known = {name: arm for name, arm in seen.arms.items() if name in believed}
        return sense(replace(seen, arms=known), self._believed)

    def _setpoints(self) -> dict[str, Pose]:
        arms = self._world.observe().arms
        return {name: arms[name].setpoint_tissue_from_tip for name in self._believed.arms}
