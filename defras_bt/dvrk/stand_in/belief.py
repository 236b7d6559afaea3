"""What a laboratory that has measured its robot believes of the stand-in and its patient."""

from __future__ import annotations

from defras_bt.dvrk.stand_in.imperfections import Imperfections
from defras_bt.dvrk.stand_in.order import WorldName
from defras_sim.effects import library
from defras_sim.effects.effect import ArmEffect
from defras_sim.scene import Scene


def measured_belief(scene: Scene, imperfections: Imperfections, world: WorldName) -> Scene:
    """``scene`` with what ``defras diagnose --twin arm`` finds of the arms' joints.

    Errors of registration stay unknown, and so does what the cameras do. Beside a patient in
    PyBullet the twin shares its tetrahedra and material.

    Raises:
        NotASlab: PyBullet cannot simulate this patient.
    """
    joints = {name: own for name, own in imperfections.extension.items() if _of_joints(name)}
    known = scene.extended({**scene.model.extension, **joints})
    return known.for_bullet() if world == "bullet" else known


def _of_joints(name: str) -> bool:
    effect = library.effect(name)
    return isinstance(effect, ArmEffect) and type(effect).joints is not ArmEffect.joints
