"""Where the joints of an arm really go when they are told where to go."""

from __future__ import annotations

from defras_sim.effects import library
from defras_sim.effects.effect import ArmEffect, Extension
from defras_sim.geometry import Floats


def true_joints(model: Extension, time_s: Floats, setpoint: Floats) -> Floats:
    """Joints (n, 6) [rad, rad, m, rad, rad, rad] that come of those commanded (n, 6) over time.

    Effects act in the order of the drive, from the motor to the joint.

    Raises:
        ValueError: an effect of ``model`` is unknown, does not act on an arm, or a parameter is
            unknown or out of bounds.
    """
    joints = setpoint
    for effect in sorted(map(_arm_effect, model), key=lambda effect: effect.place):
        joints = effect.joints(model[effect.name], time_s, joints)
    return joints


def _arm_effect(name: str) -> ArmEffect:
    effect = library.effect(name)
    if isinstance(effect, ArmEffect):
        return effect
    raise ValueError(f"{name} does not act on an arm; it belongs to the layer {effect.layer}")
