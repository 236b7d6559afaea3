"""Messages of either ROS as ours: their fields are the same, only stamps are not."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from defras_bt.dvrk.transport.messages import (
    JointMessage,
    PoseMessage,
    StateMessage,
    WrenchMessage,
)
from defras_sim.geometry import Pose

StampOf = Callable[[Any], float]
"""Seconds of the stamp in a message's header."""


def pose(message: Any, stamp_s: StampOf) -> PoseMessage:
    place, turn = message.pose.position, message.pose.orientation
    quaternion = np.array([turn.x, turn.y, turn.z, turn.w])
    # A quaternion of length 0 turns nothing: some drivers send it while a pose is not valid.
    sound = np.isfinite(quaternion).all() and quaternion.any()
    rotation = Rotation.from_quat(quaternion).as_matrix() if sound else np.full((3, 3), np.nan)
    place_and_turn = Pose(np.array([place.x, place.y, place.z]), rotation)
    return PoseMessage(stamp_s(message), message.header.frame_id, place_and_turn)


def joints(message: Any, stamp_s: StampOf) -> JointMessage:
    return JointMessage(
        stamp_s(message),
        tuple(message.name),
        np.array(message.position, float),
        np.array(message.velocity, float),
        message.header.frame_id,
    )


def wrench(message: Any, stamp_s: StampOf) -> WrenchMessage:
    force = message.wrench.force
    return WrenchMessage(
        stamp_s(message), message.header.frame_id, np.array([force.x, force.y, force.z])
    )


def state(message: Any, stamp_s: StampOf) -> StateMessage:
    return StateMessage(
        stamp_s(message),
        message.state,
        bool(message.is_homed),
        bool(message.is_busy),
        message.header.frame_id,
    )
