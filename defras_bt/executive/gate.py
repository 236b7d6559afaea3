"""CommandGate: the last check of every command. It never trusts the tree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defras_bt.executive.blackboard import TickInputs
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.worlds.protocol import ArmCommand, ArmObservation, Command

# Tips may not go deeper than the grasp depth plus this, nor farther out than the slab plus this.
BELOW_SURFACE_M = 0.003
BESIDE_TISSUE_M = 0.10
ABOVE_TISSUE_M = 0.12


@dataclass(frozen=True)
class GateVerdict:
    """What may be sent, and in words why it differs from what was proposed."""

    command: Command
    reasons: tuple[str, ...]


class CommandGate:
    """Scales, clips or zeroes each command from the tick's inputs alone.

    Motion is zero on any trip. Jaws may still move on a trip that concerns only force or shape,
    so that the tree can let go of tissue on the spot; without sensors they keep their grip.
    """

    def __init__(self, scene: Scene, metric: str | None) -> None:
        self._motion = scene.motion
        self._tick_s = scene.tick_s
        self._metric = metric
        half = np.array([scene.tissue.length_x_m, scene.tissue.width_y_m]) / 2 + BESIDE_TISSUE_M
        self._low_m = np.array([*-half, -BELOW_SURFACE_M])
        self._high_m = np.array([*half, ABOVE_TISSUE_M])

    def check(
        self, proposed: Command, rate: float, inputs: TickInputs, trip: str | None = None
    ) -> GateVerdict:
        """The command that may leave. ``trip``: a reason that the executive knows of."""
        reasons = self._trips(inputs, trip)
        if not (np.isfinite(rate) and 0.0 <= rate <= 1.0):
            reasons.append(f"rate {rate} is not between 0 and 1")
        blind = bool(trip or inputs.missing or inputs.operator_stop)
        holding = any(arm.grasped for arm in inputs.observation.arms.values())
        arms = {}
        for name, command in proposed.arms.items():
            if name not in inputs.observation.arms:
                reasons.append(f"{name} is not an arm of this set-up")
                continue
            observed = inputs.observation.arms[name]
            if not _finite(command):
                reasons.append(f"the command for {name} is not a number")
                continue
            if reasons:
                arms[name] = ArmCommand(jaw_rad=None if blind else command.jaw_rad)
                continue
            arms[name] = self._limited(command, rate, observed, holding)
        return GateVerdict(Command(arms), tuple(reasons))

    def _trips(self, inputs: TickInputs, trip: str | None) -> list[str]:
        reasons = [trip] if trip else []
        reasons += inputs.missing
        if inputs.operator_stop:
            reasons.append(inputs.operator_stop)
        if np.isnan(inputs.force_n):
            reasons.append("the force estimate is missing")
        if self._metric is not None and inputs.reading is not None:
            state = inputs.reading.warning_state[self._metric]
            if np.isnan(inputs.reading.mu_m[self._metric]):
                reasons.append("the discrepancy is unknown")
            elif state >= 2:
                reasons.append(f"the warning state is {state}")
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
            _clipped(command.angular_rad_s, 1.0) * rate,
            command.jaw_rad,
        )


def _clipped(vector: Floats, limit: float) -> Floats:
    length = float(np.linalg.norm(vector))
    return vector * (limit / length) if length > limit else vector


def _finite(command: ArmCommand) -> bool:
    jaw = 0.0 if command.jaw_rad is None else command.jaw_rad
    return bool(
        np.all(np.isfinite(command.linear_m_s))
        and np.all(np.isfinite(command.angular_rad_s))
        and np.isfinite(jaw)
    )
