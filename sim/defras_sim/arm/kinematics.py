"""Forward and inverse kinematics of a PSM, and its Jacobian."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from defras_sim.arm.dh import (
    INSERTION,
    JOINT_HIGH,
    JOINT_LOW,
    SHAFT_BEYOND_RCM_M,
    WRIST_FROM_TIP,
    link_poses,
)
from defras_sim.geometry import Floats, Pose

_POSITION_TOLERANCE_M = 1e-7
_ROTATION_TOLERANCE_RAD = 1e-5
_MOST_ITERATIONS = 60
# One radian of orientation weighs as much as this much of position.
_LEVER_M = 0.05
_LONGEST_STEP = 0.2


class Unreachable(ValueError):
    """No joint position within the limits brings the tip to the pose."""


def tip_pose(joints: Floats) -> Pose:
    """base_from_tip for joints (6,)."""
    return link_poses(joints)[-1] @ WRIST_FROM_TIP


def jacobian(joints: Floats) -> Floats:
    """(6, 6): tip velocity, then angular velocity, in the base frame, per joint velocity."""
    links = link_poses(joints)
    tip_m = (links[-1] @ WRIST_FROM_TIP).position_m
    columns = []
    for index, link in enumerate(links):
        axis = link.rotation[:, 2]
        if index == INSERTION:
            columns.append(np.concatenate([axis, np.zeros(3)]))
        else:
            columns.append(np.concatenate([np.cross(axis, tip_m - link.position_m), axis]))
    return np.array(columns).T


def joints_for(base_from_tip: Pose, start: Floats) -> Floats:
    """Joints (6,) that bring the tip to the pose, nearest to ``start`` (6,).

    Damped Gauss-Newton from ``start``: meant for streaming, where poses follow one another.

    Raises:
        Unreachable: the pose lies outside the joint limits or the reach.
    """
    low = JOINT_LOW.copy()
    low[INSERTION] = SHAFT_BEYOND_RCM_M
    joints = np.clip(start, low, JOINT_HIGH)
    scale = np.concatenate([np.ones(3), np.full(3, _LEVER_M)])
    error = _error(base_from_tip, joints)
    for _ in range(_MOST_ITERATIONS):
        if _small(error):
            return joints
        j = jacobian(joints) * scale[:, None]
        damping = 1e-9 + 1e-3 * float(np.dot(scale * error, scale * error))
        step = np.linalg.solve(j.T @ j + damping * np.eye(6), j.T @ (scale * error))
        step *= min(1.0, _LONGEST_STEP / max(float(np.abs(step).max()), 1e-12))
        joints = np.clip(joints + step, low, JOINT_HIGH)
        error = _error(base_from_tip, joints)
    if _small(error):
        return joints
    raise Unreachable(
        f"tip at {np.round(base_from_tip.position_m, 4)} m from the remote centre misses by "
        f"{np.linalg.norm(error[:3]) * 1e3:.2f} mm and {np.linalg.norm(error[3:]):.3f} rad; joints "
        f"must stay between {low} and {JOINT_HIGH}"
    )


def _error(wanted: Pose, joints: Floats) -> Floats:
    """Position and rotation (6,) still to go, in the base frame."""
    now = tip_pose(joints)
    turn = Rotation.from_matrix(wanted.rotation @ now.rotation.T).as_rotvec()
    return np.concatenate([wanted.position_m - now.position_m, turn])


def _small(error: Floats) -> bool:
    return bool(
        np.linalg.norm(error[:3]) < _POSITION_TOLERANCE_M
        and np.linalg.norm(error[3:]) < _ROTATION_TOLERANCE_RAD
    )
