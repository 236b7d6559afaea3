"""Joints of a PSM from the pose of its tip, in closed form.

Wrist pitch and wrist yaw axis are perpendicular, and the pitch axis is perpendicular to the shaft,
which passes through the remote centre. So the remote centre, the yaw axis' origin and the yaw
axis' direction lie in one plane whose normal is the pitch axis: from there every joint follows by
projection. Unlike :func:`defras_sim.arm.kinematics.joints_for` it needs no start and says where
the joints would have to be even where no arm can go, which is what a check of limits asks for.
"""

from __future__ import annotations

from math import asin, atan2, cos, hypot, pi, sin

import numpy as np

from defras_sim.arm.dh import ROWS, WRIST_TO_TIP_M
from defras_sim.geometry import Floats, Pose

_PITCH_TO_YAW_M = ROWS[5].a
_INSERTION_AT_RCM_M = -(ROWS[2].d + ROWS[3].d)
"""Insertion at which the wrist pitch axis would stand in the remote centre."""
_SMALLEST_M = 1e-9


class Undetermined(ValueError):
    """The yaw axis points at the remote centre: any wrist pitch axis would do."""


def joints_of(base_from_tip: Pose) -> Floats:
    """Joints (6,) that bring the tip to the pose, whether the arm can go there or not.

    Of the two solutions it is the one whose wrist bends by less than a right angle; the roll lies
    between -pi and pi.

    Raises:
        Undetermined: the wrist's yaw axis points at the remote centre.
    """
    turn = base_from_tip.rotation
    approach, yaw_axis = turn[:, 2], -turn[:, 0]
    yaw_origin_m = base_from_tip.position_m - WRIST_TO_TIP_M * approach
    normal = _cross(yaw_origin_m, yaw_axis)
    length_m = _length(normal)
    if length_m < _SMALLEST_M:
        raise Undetermined(
            f"at {np.round(base_from_tip.position_m, 4)} m from the remote centre the wrist's yaw "
            "axis points at it; turn the tip"
        )
    pitch_axis = normal / length_m
    link = _cross(yaw_axis, pitch_axis)  # from the pitch axis to the yaw axis
    if link @ (yaw_origin_m - _PITCH_TO_YAW_M * link) < 0.0:
        pitch_axis, link = -pitch_axis, -link
    pitch_origin_m = yaw_origin_m - _PITCH_TO_YAW_M * link
    depth_m = _length(pitch_origin_m)
    shaft = pitch_origin_m / depth_m
    yaw = atan2(shaft[0], -shaft[2])
    pitch = asin(min(1.0, max(-1.0, -shaft[1])))
    across = np.array([-sin(yaw) * sin(pitch), -cos(pitch), cos(yaw) * sin(pitch)])
    rolled = _cross(pitch_axis, shaft)
    return np.array(
        [
            yaw,
            pitch,
            depth_m + _INSERTION_AT_RCM_M,
            atan2(float(rolled @ _cross(shaft, across)), float(rolled @ across)),
            atan2(float(link @ rolled), float(link @ shaft)),
            atan2(float(-approach @ pitch_axis), float(approach @ link)),
        ]
    )


def turned_back(angle_rad: float) -> float:
    """The same angle between -pi and pi."""
    return (angle_rad + pi) % (2 * pi) - pi


def _length(vector: Floats) -> float:
    return hypot(*vector)


def _cross(a: Floats, b: Floats) -> Floats:
    """np.cross spends most of its time on finding out that these are plain vectors."""
    return np.array(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )
