"""Joints of a PSM from the pose of its tip, in closed form.

Wrist pitch and wrist yaw axis are perpendicular, and the pitch axis is perpendicular to the shaft,
which passes through the remote centre. So the remote centre, the yaw axis' origin and the yaw
axis' direction lie in one plane whose normal is the pitch axis: from there every joint follows by
projection. Unlike :func:`defras_sim.arm.kinematics.joints_for` it needs no start and says where
the joints would have to be even where no arm can go, which is what a check of limits asks for.
"""

from __future__ import annotations

from math import asin, atan2, cos, pi, sin, sqrt

import numpy as np
from numba import njit

from defras_sim.arm.dh import ROWS, WRIST_TO_TIP_M
from defras_sim.geometry import Floats, Pose

_PITCH_TO_YAW_M = ROWS[5].a
_INSERTION_AT_RCM_M = -(ROWS[2].d + ROWS[3].d)
"""Insertion at which the wrist pitch axis would stand in the remote centre."""
_SMALLEST_M = 1e-9
_Vector = tuple[float, float, float]
jit = njit(cache=True, nogil=True)


class Undetermined(ValueError):
    """The yaw axis points at the remote centre: any wrist pitch axis would do."""


def joints_of(base_from_tip: Pose) -> Floats:
    """Joints (6,) that bring the tip to the pose, whether the arm can go there or not.

    Of the two solutions it is the one whose wrist bends by less than a right angle; the roll lies
    between -pi and pi.

    Raises:
        Undetermined: the wrist's yaw axis points at the remote centre.
    """
    return joints_at(base_from_tip.position_m, base_from_tip.rotation)


def joints_at(position_m: Floats, rotation: Floats) -> Floats:
    """As :func:`joints_of`, of a pose in two parts: of its position (3,) and rotation (3, 3)."""
    joints, found = joints_and_whether(rotation, position_m)
    if not found:
        raise Undetermined(
            f"at {np.round(position_m, 4)} m from the remote centre the wrist's yaw "
            "axis points at it; turn the tip"
        )
    return joints


@jit
def joints_and_whether(turn: Floats, position_m: Floats) -> tuple[Floats, bool]:
    """Joints (6,), and whether the wrist's pitch axis is determined."""
    approach = (turn[0, 2], turn[1, 2], turn[2, 2])
    yaw_axis = (-turn[0, 0], -turn[1, 0], -turn[2, 0])
    position = (position_m[0], position_m[1], position_m[2])
    yaw_origin_m = _sum(position, approach, -WRIST_TO_TIP_M)
    normal, joints = _cross(yaw_origin_m, yaw_axis), np.full(6, np.nan)
    length_m = sqrt(_dot(normal, normal))
    if length_m < _SMALLEST_M:
        return joints, False
    pitch_axis = _scaled(normal, 1.0 / length_m)
    link = _cross(yaw_axis, pitch_axis)  # from the pitch axis to the yaw axis
    if _dot(link, _sum(yaw_origin_m, link, -_PITCH_TO_YAW_M)) < 0.0:
        pitch_axis, link = _scaled(pitch_axis, -1.0), _scaled(link, -1.0)
    pitch_origin_m = _sum(yaw_origin_m, link, -_PITCH_TO_YAW_M)
    depth_m = sqrt(_dot(pitch_origin_m, pitch_origin_m))
    shaft = _scaled(pitch_origin_m, 1.0 / depth_m)
    yaw = atan2(shaft[0], -shaft[2])
    pitch = asin(min(1.0, max(-1.0, -shaft[1])))
    across = (-sin(yaw) * sin(pitch), -cos(pitch), cos(yaw) * sin(pitch))
    rolled = _cross(pitch_axis, shaft)
    joints[0], joints[1], joints[2] = yaw, pitch, depth_m + _INSERTION_AT_RCM_M
    joints[3] = atan2(_dot(rolled, _cross(shaft, across)), _dot(rolled, across))
    joints[4] = atan2(_dot(link, rolled), _dot(link, shaft))
    joints[5] = atan2(-_dot(approach, pitch_axis), _dot(approach, link))
    return joints, True


@jit
def turned_back(angle_rad: float) -> float:
    """The same angle between -pi and pi."""
    return (angle_rad + pi) % (2 * pi) - pi


@jit
def _dot(a: _Vector, b: _Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@jit
def _scaled(a: _Vector, by: float) -> _Vector:
    return a[0] * by, a[1] * by, a[2] * by


@jit
def _sum(a: _Vector, b: _Vector, times: float) -> _Vector:
    """``a`` and ``b``, the latter so many times."""
    return a[0] + times * b[0], a[1] + times * b[1], a[2] + times * b[2]


@jit
def _cross(a: _Vector, b: _Vector) -> _Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
