"""CommandGate: the last check of every command. It never trusts the tree."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import hypot, isfinite, isnan

import numpy as np

from defras_bt.executive.blackboard import TickInputs
from defras_bt.sensing.freshness import stale
from defras_sim.arm.limits import ArmLimits
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.worlds.protocol import (
    HOLD,
    JAW_CLOSED_RAD,
    JAW_OPEN_RAD,
    ArmCommand,
    ArmObservation,
    Command,
    Observation,
)

# Tips may not go deeper than the grasp depth plus this, nor farther out than the tissue plus this.
BELOW_SURFACE_M = 0.003
BESIDE_TISSUE_M = 0.10
ABOVE_TISSUE_M = 0.12
TURNING_RAD_S = 1.0
# Behind the tree's own force guard: slow at once, stopped a little later than the tree should.
RATE_OVER_FORCE = 0.5
FORCE_PATIENCE_S = 1.0


@dataclass(frozen=True)
class Proposal:
    """What the tree came to at a tick.

    ``acting``: whether an action, a leaf of role "motion", was under way when the tick ended.
    ``time_s``: world time when the tree returned; in a world that does not wait, later than that
    of the inputs.
    """

    command: Command
    rate: float
    acting: bool
    time_s: float


@dataclass(frozen=True)
class GateVerdict:
    """What may be sent, and in words why motion that was proposed is not in it."""

    command: Command
    reasons: tuple[str, ...]


class CommandGate:
    """Scales, clips or zeroes each command from the tick's inputs alone.

    Motion of every arm is zero on any trip. Where force or shape trip, or nobody owns up to the
    motion, jaws may still move, so that the tree can let go of tissue on the spot; where sensors,
    operator, the time the tree took or the command itself do, every jaw keeps its grip. What is
    left is slowed to the limits of speed, and cut off where the tip would leave the workspace or a
    joint its limits.
    """

    def __init__(self, scene: Scene, metric: str | None) -> None:
        self._scene = scene
        self._metric = metric
        self._arms: Mapping[str, ArmLimits] = {
            name: ArmLimits(np.array(arm.rcm_m)) for name, arm in scene.arms.items()
        }
        shape = scene.tissue.shape
        low, high = shape.low_m - BESIDE_TISSUE_M, shape.high_m + BESIDE_TISSUE_M
        self._low_m = np.array([*low[:2], scene.lowest_grasp_m - BELOW_SURFACE_M])
        self._high_m = np.array([*high[:2], float(shape.high_m[2]) + ABOVE_TISSUE_M])

    def check(self, proposed: Proposal, inputs: TickInputs) -> GateVerdict:
        """The command that may leave."""
        blind = [
            *_blindness(inputs),
            *self._lateness(proposed.time_s, inputs),
            *self._faults(proposed, inputs.observation),
        ]
        bound = [*self._tissue_trips(inputs), *_ownerless(proposed)]
        if blind:
            return GateVerdict(HOLD, (*blind, *bound))
        if bound:
            jaws = {n: ArmCommand(jaw_rad=_jaw(arm)) for n, arm in proposed.command.arms.items()}
            return GateVerdict(Command(jaws), tuple(bound))
        rate = proposed.rate
        if inputs.force_over:
            rate = min(rate, RATE_OVER_FORCE)
        observed = inputs.observation.arms
        # A jaw that does not tell may hold tissue.
        holding = any(arm.grasped is not False for arm in observed.values())
        motion = self._scene.motion
        speed_m_s = motion.tissue_speed_m_s if holding else motion.reach_speed_m_s
        arms, reasons = {}, []
        for name, command in proposed.command.arms.items():
            slowed = _slowed(command, speed_m_s, rate)
            arms[name], stopped = self._in_reach(name, slowed, observed[name])
            if stopped:
                reasons.append(f"{name} is at its limits: {stopped}")
        return GateVerdict(Command(arms), tuple(reasons))

    def _lateness(self, time_s: float, inputs: TickInputs) -> list[str]:
        """What the tree knew may have been fresh when it started, and too old when it returned."""
        seen = inputs.observation
        if time_s == seen.time_s:
            return []
        late_s = time_s - seen.time_s
        if not late_s >= 0.0:
            return [f"the tree returned at {time_s} s, before its inputs of {seen.time_s:.2f} s"]
        aged = stale(replace(seen, time_s=time_s), self._scene)
        return [f"the tree took {late_s:.2f} s: {sentence}" for sentence in aged.values()]

    def _faults(self, proposed: Proposal, observation: Observation) -> list[str]:
        """What is wrong with the command itself: one fault, and nothing of it is trusted."""
        faults = []
        if not 0.0 <= proposed.rate <= 1.0:
            faults.append(f"rate {proposed.rate} is not between 0 and 1")
        for name, command in proposed.command.arms.items():
            observed = observation.arms.get(name)
            if observed is None or name not in self._arms:
                faults.append(f"{name} is not an arm of this set-up")
            elif not (_is_vector(command.linear_m_s) and _is_vector(command.angular_rad_s)):
                faults.append(f"the command for {name} has not three components")
            elif not command.is_finite:
                faults.append(f"the command for {name} is not a number")
            elif not all(map(isfinite, observed.commanded_tissue_from_tip.position_m.tolist())):
                faults.append(f"the set-point of {name} is not a number")
        return faults

    def _tissue_trips(self, inputs: TickInputs) -> list[str]:
        """What speaks against moving tissue, but not against letting it go."""
        reasons = []
        if isnan(inputs.force_n):
            reasons.append("the force estimate is missing")
        elif inputs.force_over_s >= FORCE_PATIENCE_S:
            reasons.append(
                f"the force is {inputs.force_n:.2f} N, over its threshold of "
                f"{inputs.force_threshold_n:.2f} N for {inputs.force_over_s:.2f} s"
            )
        if self._metric is not None:
            reading = inputs.reading
            if reading is None or isnan(reading.mu_m[self._metric]):
                reasons.append("the discrepancy is unknown")
            elif reading.warning_state[self._metric] >= 2:
                reasons.append(f"the warning state is {reading.warning_state[self._metric]}")
        return reasons

    def _in_reach(
        self, name: str, command: ArmCommand, observed: ArmObservation
    ) -> tuple[ArmCommand, str]:
        """The part of a command that keeps workspace and joint limits; why nothing is left."""
        tick_s, tip = self._scene.tick_s, observed.commanded_tissue_from_tip
        start = tip.position_m
        # Outside the workspace only motion back into it is let through.
        low_m, high_m = np.minimum(start, self._low_m), np.maximum(start, self._high_m)
        end = np.minimum(np.maximum(start + command.linear_m_s * tick_s, low_m), high_m)
        linear_m, angular_rad = end - start, command.angular_rad_s * tick_s
        if not (linear_m.any() or angular_rad.any()):
            return ArmCommand(jaw_rad=command.jaw_rad), ""
        allowed = self._arms[name].allowed(tip, linear_m, angular_rad, tick_s)
        rate = allowed.share / tick_s
        limited = ArmCommand(linear_m * rate, angular_rad * rate, command.jaw_rad)
        return limited, "" if allowed.share > 0.0 else allowed.reason


def _blindness(inputs: TickInputs) -> list[str]:
    """Reasons to touch nothing, jaws included."""
    return [stop for stop in (*inputs.missing, inputs.operator.forbids) if stop]


def _ownerless(proposed: Proposal) -> list[str]:
    """Motion may only come from an action that goes on: not from one that a guard has ended."""
    moving = any(arm.moves for arm in proposed.command.arms.values())
    if moving and not proposed.acting:
        return ["motion was proposed, but no action was under way when the tick ended"]
    return []


def _slowed(command: ArmCommand, speed_m_s: float, rate: float) -> ArmCommand:
    return ArmCommand(
        _clipped(command.linear_m_s, speed_m_s) * rate,
        _clipped(command.angular_rad_s, TURNING_RAD_S) * rate,
        _jaw(command),
    )


def _is_vector(value: object) -> bool:
    return isinstance(value, np.ndarray) and value.shape == (3,)


def _jaw(command: ArmCommand) -> float | None:
    if command.jaw_rad is None:
        return None
    return min(max(float(command.jaw_rad), JAW_CLOSED_RAD), JAW_OPEN_RAD)


def _clipped(vector: Floats, limit: float) -> Floats:
    """``vector`` (3,) of at most ``limit``, even where its own square is too large a number."""
    largest = max(map(abs, vector.tolist()))
    if largest == 0.0:
        return vector
    shape = vector / largest
    length = hypot(*shape.tolist())
    return vector if largest <= limit / length else shape * (limit / length)
