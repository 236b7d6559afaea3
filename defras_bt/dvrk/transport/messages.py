"""What an arm says, whatever carried it. Stamps are seconds of the clock that stamped them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from defras_sim.geometry import Floats, Pose

POSES = ("measured_cp", "setpoint_cp", "local/measured_cp", "local/setpoint_cp")
JOINTS = ("measured_js", "setpoint_js", "jaw/measured_js", "jaw/setpoint_js")
WRENCHES = ("body/measured_cf",)
STATES = ("operating_state",)
TOPICS = (*POSES, *JOINTS, *WRENCHES, *STATES)
"""CRTK topics that the client listens to, below the arm's name."""


@dataclass(frozen=True)
class PoseMessage:
    """``pose``: frame_from_reported, where ``frame`` is what the poses are given in."""

    stamp_s: float
    frame: str
    pose: Pose


@dataclass(frozen=True)
class JointMessage:
    """``position`` and ``velocity`` (n,) in rad and m, per s; velocity may be empty."""

    stamp_s: float
    names: tuple[str, ...]
    position: Floats
    velocity: Floats = field(default_factory=lambda: np.zeros(0))
    frame: str = ""


@dataclass(frozen=True)
class StateMessage:
    """DISABLED, ENABLED, PAUSED or FAULT; an arm moves only ENABLED and homed."""

    stamp_s: float
    state: str
    is_homed: bool
    is_busy: bool
    frame: str = ""


@dataclass(frozen=True)
class WrenchMessage:
    """``force_n`` (3,), as the driver makes it of motor currents; rough."""

    stamp_s: float
    frame: str
    force_n: Floats


Message = PoseMessage | JointMessage | StateMessage | WrenchMessage
