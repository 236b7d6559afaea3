"""Patient-side manipulator of a da Vinci Research Kit with a ProGrasp instrument, in DH rows.

Numbers: saw-intuitive-research-kit, ``share/kinematic/PSM.json`` and
``share/tool/PROGRASP_FORCEPS_400093.json`` (modified Denavit-Hartenberg convention). Base frame:
origin at the remote centre of motion, z up; with all joints at zero the instrument points down.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defras_sim.geometry import Floats, Pose

JOINT_NAMES = ("yaw", "pitch", "insertion", "roll", "wrist_pitch", "wrist_yaw")
INSERTION = 2
"""Index of the only prismatic joint."""

JOINT_LOW = np.array([-1.588, -0.925, 0.0, -4.538, -1.396, -1.396])
JOINT_HIGH = np.array([1.588, 0.925, 0.24, 4.538, 1.396, 1.396])
JOINT_SPEED = np.array([np.pi / 2, np.pi / 2, 0.2, 6 * np.pi, 6 * np.pi, 6 * np.pi])
"""Limits in rad, rad/s; m, m/s for the insertion."""

SHAFT_BEYOND_RCM_M = 0.0606
"""Smallest insertion: the shaft's end stays 45 mm beyond the remote centre."""

WRIST_TO_TIP_M = 0.0286
"""The dVRK reports the origin of the wrist-yaw axis; the jaw's ends are this much farther."""


@dataclass(frozen=True)
class DhRow:
    """``alpha``, ``a`` before the joint; ``d``, ``theta`` along and about it, without the joint."""

    alpha: float
    a: float
    d: float
    theta: float


ROWS = (
    DhRow(np.pi / 2, 0.0, 0.0, np.pi / 2),
    DhRow(-np.pi / 2, 0.0, 0.0, -np.pi / 2),
    DhRow(np.pi / 2, 0.0, -0.4318, 0.0),
    DhRow(0.0, 0.0, 0.4162, 0.0),
    DhRow(-np.pi / 2, 0.0, 0.0, -np.pi / 2),
    DhRow(-np.pi / 2, 0.0107, 0.0, -np.pi / 2),
)

# From the last DH frame, whose y axis points along the closed jaw, to the tip, whose z axis does.
WRIST_FROM_TIP = Pose(
    np.array([0.0, WRIST_TO_TIP_M, 0.0]),
    np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]]),
)


def link_poses(joints: Floats) -> list[Pose]:
    """base_from_link after each of the six joints; the last one is the wrist-yaw frame."""
    pose, poses = Pose(np.zeros(3)), []
    for index, (row, joint) in enumerate(zip(ROWS, joints, strict=True)):
        theta = row.theta + (0.0 if index == INSERTION else joint)
        d = row.d + (joint if index == INSERTION else 0.0)
        pose = pose @ _transform(row.alpha, row.a, d, theta)
        poses.append(pose)
    return poses


def _transform(alpha: float, a: float, d: float, theta: float) -> Pose:
    ca, sa, ct, st = np.cos(alpha), np.sin(alpha), np.cos(theta), np.sin(theta)
    rotation = np.array([[ct, -st, 0.0], [st * ca, ct * ca, -sa], [st * sa, ct * sa, ca]])
    return Pose(np.array([a, -sa * d, ca * d]), rotation)
