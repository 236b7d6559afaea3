"""Faults of the arms: one that does not follow, jumps, loses tissue, or does not hear."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from defras_bt.faults.fault import Fault, Injector
from defras_bt.sensing.arms import FOLLOWING_M, JUMP_M
from defras_bt.sensing.dead_reckoning import ALLOWED_SHARE, STRAYED_M, shortened
from defras_sim.scene import ArmName, Scene, Vector
from defras_sim.worlds.protocol import (
    JAW_OPEN_RAD,
    ArmCommand,
    ArmObservation,
    Command,
    Observation,
)

_SPRUNG_S = 0.5
"""So long a jaw that lost the tissue stays open by force."""


class ArmFault(Fault):
    """Base of the faults of one arm."""

    arm: ArmName = "psm1"


class ArmInjector(Injector):
    """Base of the arm faults at work."""

    _fault: ArmFault

    def __init__(self, fault: ArmFault, scene: Scene, rng: np.random.Generator) -> None:
        super().__init__(fault, rng)
        self._arm = fault.arm
        self._scene = scene

    def changed(self, command: Command, wanted: ArmCommand) -> Command:
        return Command({**command.arms, self._arm: wanted})


class NotFollowing(ArmFault):
    """An arm is blocked: its set-point moves as commanded, its tip and jaw stay."""

    kind: ClassVar[str] = "not_following"

    def injector(self, scene: Scene, rng: np.random.Generator) -> Injector:
        return _NotFollowing(self, scene, rng)


class _NotFollowing(ArmInjector):
    def __init__(self, fault: ArmFault, scene: Scene, rng: np.random.Generator) -> None:
        super().__init__(fault, scene, rng)
        self._ahead_m = np.zeros(3)

    def observed(self, true: Observation, delivered: Observation) -> Observation:
        self.trip = ""
        if not self._fault.active(true.time_s):
            self._ahead_m = np.zeros(3)
        if self._arm not in delivered.arms or not self._ahead_m.any():
            return delivered
        arm = delivered.arms[self._arm]
        setpoint = arm.setpoint_tissue_from_tip.moved(self._ahead_m)
        if np.linalg.norm(setpoint.position_m - arm.tissue_from_tip.position_m) > FOLLOWING_M:
            self.trip = f"{self._arm} does not follow"
        arms = {**delivered.arms, self._arm: replace(arm, setpoint_tissue_from_tip=setpoint)}
        return replace(delivered, arms=arms)

    def commanded(self, command: Command, true: Observation) -> Command:
        wanted = command.arms.get(self._arm)
        if wanted is None or not self._fault.active(true.time_s):
            return command
        self._ahead_m = self._ahead_m + wanted.linear_m_s * self._scene.tick_s
        return self.changed(command, ArmCommand())


class Jumped(ArmFault):
    """An encoder slips: tip and set-point are read ``offset_m`` away from where they are."""

    kind: ClassVar[str] = "jumped"
    offset_m: Vector = (0.02, 0.0, 0.0)

    def injector(self, scene: Scene, rng: np.random.Generator) -> Injector:
        return _Jumped(self, scene, rng)


class _Jumped(ArmInjector):
    _fault: Jumped

    def __init__(self, fault: ArmFault, scene: Scene, rng: np.random.Generator) -> None:
        super().__init__(fault, scene, rng)
        self._seen_right = False

    def observed(self, true: Observation, delivered: Observation) -> Observation:
        self.trip = ""
        if self._arm not in delivered.arms or not self.happens(true.time_s):
            self._seen_right = True
            return delivered
        offset_m, arm = np.array(self._fault.offset_m), delivered.arms[self._arm]
        # Where the arm was never read rightly, nobody can see that it jumped.
        explained_m = JUMP_M + 2 * self._scene.motion.reach_speed_m_s * self._scene.tick_s
        if self._seen_right and np.linalg.norm(offset_m) > explained_m:
            self.trip = f"{self._arm} jumped"
        shifted = replace(
            arm,
            tissue_from_tip=arm.tissue_from_tip.moved(offset_m),
            setpoint_tissue_from_tip=arm.setpoint_tissue_from_tip.moved(offset_m),
        )
        return replace(delivered, arms={**delivered.arms, self._arm: shifted})


class JawStuck(ArmFault):
    """A jaw neither opens nor closes."""

    kind: ClassVar[str] = "jaw_stuck"

    def injector(self, scene: Scene, rng: np.random.Generator) -> Injector:
        return _JawStuck(self, scene, rng)


class _JawStuck(ArmInjector):
    def commanded(self, command: Command, true: Observation) -> Command:
        wanted = command.arms.get(self._arm)
        if wanted is None or not self._fault.active(true.time_s):
            return command
        return self.changed(command, replace(wanted, jaw_rad=None))


class CommandsLost(ArmFault):
    """Commands do not reach an arm: it holds where it is, set-point and all."""

    kind: ClassVar[str] = "commands_lost"

    def injector(self, scene: Scene, rng: np.random.Generator) -> Injector:
        return _CommandsLost(self, scene, rng)


class _Unheard(ArmInjector):
    """Base: sums up motion that was commanded and is not seen, less what may go differently."""

    def __init__(self, fault: ArmFault, scene: Scene, rng: np.random.Generator) -> None:
        super().__init__(fault, scene, rng)
        self._unseen_m = np.zeros(3)

    def told(self, wanted: ArmCommand, *, seen: bool) -> None:
        """The arm is told ``wanted``; ``seen``: its readings will show it."""
        step_m = wanted.linear_m_s * self._scene.tick_s
        more_m = self._unseen_m if seen else self._unseen_m + step_m
        self._unseen_m = shortened(more_m, ALLOWED_SHARE * float(np.linalg.norm(step_m)))

    def judge(self) -> None:
        # What rounding decides is nobody's fault.
        strayed = np.linalg.norm(self._unseen_m) > STRAYED_M + 1e-9
        self.trip = f"{self._arm} does not go where it is told" if strayed else ""


class _CommandsLost(_Unheard):
    def observed(self, true: Observation, delivered: Observation) -> Observation:
        self.judge()
        return delivered

    def commanded(self, command: Command, true: Observation) -> Command:
        wanted = command.arms.get(self._arm)
        if wanted is None:
            return command
        lost = self.happens(true.time_s)
        self.told(wanted, seen=not lost)
        if not lost:
            return command
        return Command({name: arm for name, arm in command.arms.items() if name != self._arm})


class Republished(ArmFault):
    """An arm's driver sends its last reading again and again as if it were new."""

    kind: ClassVar[str] = "republished"

    def injector(self, scene: Scene, rng: np.random.Generator) -> Injector:
        return _Republished(self, scene, rng)


class _Republished(_Unheard):
    def __init__(self, fault: ArmFault, scene: Scene, rng: np.random.Generator) -> None:
        super().__init__(fault, scene, rng)
        self._kept: ArmObservation | None = None

    def observed(self, true: Observation, delivered: Observation) -> Observation:
        arm = delivered.arms.get(self._arm)
        if arm is None or not self._fault.active(true.time_s):
            self._kept, self._unseen_m, self.trip = None, np.zeros(3), ""
            return delivered
        self._kept = self._kept or arm
        self.judge()
        again = replace(self._kept, stamp_s=arm.stamp_s)
        return replace(delivered, arms={**delivered.arms, self._arm: again})

    def commanded(self, command: Command, true: Observation) -> Command:
        wanted = command.arms.get(self._arm)
        if wanted is not None and self._kept is not None:
            self.told(wanted, seen=False)
        return command


class GraspLost(ArmFault):
    """Held tissue slips out of the jaw: once, the first time it is held while the fault lasts."""

    kind: ClassVar[str] = "grasp_lost"

    def injector(self, scene: Scene, rng: np.random.Generator) -> Injector:
        return _GraspLost(self, scene, rng)


class _GraspLost(ArmInjector):
    def __init__(self, fault: ArmFault, scene: Scene, rng: np.random.Generator) -> None:
        super().__init__(fault, scene, rng)
        self._slipped_s: float | None = None

    def commanded(self, command: Command, true: Observation) -> Command:
        now_s = true.time_s
        held = self._arm in true.arms and true.arms[self._arm].grasped
        if self._slipped_s is None and held and self.happens(now_s):
            self._slipped_s = now_s
        if self._slipped_s is None or now_s - self._slipped_s > _SPRUNG_S:
            return command
        wanted = command.arms.get(self._arm, ArmCommand())
        return self.changed(command, replace(wanted, jaw_rad=JAW_OPEN_RAD))
