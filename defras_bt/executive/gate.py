"""CommandGate: the last check of every command. It never trusts the tree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defras_bt.executive.blackboard import TickInputs
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.worlds.protocol import HOLD, ArmCommand, ArmObservation, Command, Observation

# Tips may not go deeper than the grasp depth plus this, nor farther out than the slab plus this.
BELOW_SURFACE_M = 0.003
BESIDE_TISSUE_M = 0.10
ABOVE_TISSUE_M = 0.12
TURNING_RAD_S = 1.0
# Behind the tree's own force guard: slow at once, stopped a little later than the tree should.
RATE_OVER_FORCE = 0.5
FORCE_PATIENCE_S = 1.0


@dataclass(frozen=True)
class GateVerdict:
    """What may be sent, and in words why it differs from what was proposed."""

    command: Command
    reasons: tuple[str, ...]


class CommandGate:
    """Scales, clips or zeroes each command from the tick's inputs alone.

    Motion of every arm is zero on any trip. Where force or shape trip, jaws may still move, so that
    the tree can let go of tissue on the spot; where sensors, operator or the command itself do,
    every jaw keeps its grip.
    """

    def __init__(self, scene: Scene, metric: str | None) -> None:
        self._motion = scene.motion
        self._tick_s = scene.tick_s
        self._metric = metric
        half = np.array([scene.tissue.length_x_m, scene.tissue.width_y_m]) / 2 + BESIDE_TISSUE_M
        self._low_m = np.array([*-half, -BELOW_SURFACE_M])
        self._high_m = np.array([*half, ABOVE_TISSUE_M])

    def check(self, proposed: Command, rate: float, inputs: TickInputs) -> GateVerdict:
        """The command that may leave."""
        blind = [*_blindness(inputs), *_faults(proposed, rate, inputs.observation)]
        tissue = self._tissue_trips(inputs)
        if blind:
            return GateVerdict(HOLD, (*blind, *tissue))
        if tissue:
            jaws = {name: ArmCommand(jaw_rad=arm.jaw_rad) for name, arm in proposed.arms.items()}
            return GateVerdict(Command(jaws), tuple(tissue))
        if inputs.force_n > inputs.force_threshold_n:
            rate = min(rate, RATE_OVER_FORCE)
        observed = inputs.observation.arms
        # A jaw that does not tell may hold tissue.
        holding = any(arm.grasped is not False for arm in observed.values())
        arms = {
            name: self._limited(command, rate, observed[name], holding)
            for name, command in proposed.arms.items()
        }
        return GateVerdict(Command(arms), ())

    def _tissue_trips(self, inputs: TickInputs) -> list[str]:
        """What speaks against moving tissue, but not against letting it go."""
        reasons = []
        if np.isnan(inputs.force_n):
            reasons.append("the force estimate is missing")
        elif inputs.force_over_s >= FORCE_PATIENCE_S:
            reasons.append(
                f"the force is {inputs.force_n:.2f} N, over its threshold of "
                f"{inputs.force_threshold_n:.2f} N for {inputs.force_over_s:.2f} s"
            )
        if self._metric is not None:
            reading = inputs.reading
            if reading is None or np.isnan(reading.mu_m[self._metric]):
                reasons.append("the discrepancy is unknown")
            elif reading.warning_state[self._metric] >= 2:
                reasons.append(f"the warning state is {reading.warning_state[self._metric]}")
        return reasons

    def _limited(
        self, command: ArmCommand, rate: float, observed: ArmObservation, holding: bool
    ) -> ArmCommand:
        limit = self._motion.tissue_speed_m_s if holding else self._motion.reach_speed_m_s
        linear = _clipped(command.linear_m_s, limit) * rate
        start = observed.setpoint_tissue_from_tip.position_m
        # Outside the workspace only motion back into it is let through.
        end = np.clip(
            start + linear * self._tick_s,
            np.minimum(start, self._low_m),
            np.maximum(start, self._high_m),
        )
        return ArmCommand(
            (end - start) / self._tick_s,
            _clipped(command.angular_rad_s, TURNING_RAD_S) * rate,
            command.jaw_rad,
        )


def _blindness(inputs: TickInputs) -> list[str]:
    """Reasons to touch nothing, jaws included."""
    return [stop for stop in (*inputs.missing, inputs.operator_stop) if stop]


def _faults(proposed: Command, rate: float, observation: Observation) -> list[str]:
    """What is wrong with the command itself: one fault, and nothing of it is trusted."""
    faults = []
    if not 0.0 <= rate <= 1.0:
        faults.append(f"rate {rate} is not between 0 and 1")
    for name, command in proposed.arms.items():
        observed = observation.arms.get(name)
        if observed is None:
            faults.append(f"{name} is not an arm of this set-up")
        elif not command.is_finite:
            faults.append(f"the command for {name} is not a number")
        elif not np.all(np.isfinite(observed.setpoint_tissue_from_tip.position_m)):
            faults.append(f"the set-point of {name} is not a number")
    return faults


def _clipped(vector: Floats, limit: float) -> Floats:
    length = float(np.linalg.norm(vector))
    return vector * (limit / length) if length > limit else vector
