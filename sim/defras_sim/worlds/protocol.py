"""What every world gives and takes, simulated or real. Tissue frame, SI units, world time."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from math import isfinite
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Floats, Pose
from defras_sim.surface import Surface

JAW_OPEN_RAD = 0.8
JAW_CLOSED_RAD = 0.0


@dataclass(frozen=True)
class ArmObservation:
    """One arm as measured. The tip is the point midway between the jaw's ends.

    ``joints`` and ``setpoint_joints`` (6,): yaw, pitch [rad], insertion [m], roll, wrist pitch,
    wrist yaw [rad]; None for a world without joints. ``grasped`` is None where nothing tells.
    ``force_n`` (3,) is what a force sensor says that the jaw exerts on the tissue, None without
    one; it is recorded, and nothing is decided by it. ``goal_tissue_from_tip`` is where commands
    lead, where that is ahead of the set-point; None where a set-point is there when a tick ends.
    """

    stamp_s: float
    tissue_from_tip: Pose
    setpoint_tissue_from_tip: Pose
    jaw_rad: float
    grasped: bool | None = None
    joints: Floats | None = None
    setpoint_joints: Floats | None = None
    force_n: Floats | None = None
    goal_tissue_from_tip: Pose | None = None

    @property
    def commanded_tissue_from_tip(self) -> Pose:
        """Where the tip was last told to be: new commands go on from there."""
        goal = self.goal_tissue_from_tip
        return self.setpoint_tissue_from_tip if goal is None else goal


@dataclass(frozen=True)
class PointCloud:
    """Points (n, 3) seen on the tissue, in the tissue frame."""

    stamp_s: float
    points_m: Floats


@dataclass(frozen=True)
class CameraImage:
    """A picture. ``rgb`` (h, w, 3) uint8; ``depth_m`` (h, w) distance along the optical axis.

    ``intrinsics`` (3, 3); ``tissue_from_camera`` with the camera looking along +z, x right, y down.
    ``depth_m`` is None for a plain endoscope and NaN where nothing was hit.
    """

    stamp_s: float
    rgb: NDArray[np.uint8]
    depth_m: Floats | None
    intrinsics: Floats
    tissue_from_camera: Pose


@dataclass(frozen=True)
class Observation:
    """Everything sensed at one tick. A world fills in what it has; the rest is None.

    ``stopped`` says in sentences, by arm or reading, what a world itself knows to be no ground to
    act on: an arm that is switched off, a camera in another frame.

    ``cloud`` and ``roi_visibility`` come ready-made only from worlds without pictures; from
    pictures, sensing makes them.
    """

    time_s: float
    arms: Mapping[str, ArmObservation]
    cloud: PointCloud | None = None
    depth_image: CameraImage | None = None
    endoscope_image: CameraImage | None = None
    roi_visibility: float | None = None
    roi_visibility_stamp_s: float | None = None
    stopped: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class ArmCommand:
    """Velocity of the tip in the tissue frame for the next tick, and where the jaw should go.

    ``jaw_rad`` None keeps the jaw as it is.
    """

    linear_m_s: Floats = field(default_factory=lambda: np.zeros(3))
    angular_rad_s: Floats = field(default_factory=lambda: np.zeros(3))
    jaw_rad: float | None = None

    @property
    def is_finite(self) -> bool:
        """Whether every number in it is one."""
        jaw_rad = 0.0 if self.jaw_rad is None else self.jaw_rad
        numbers = [*self.linear_m_s.tolist(), *self.angular_rad_s.tolist(), jaw_rad]
        return all(map(isfinite, numbers))

    @property
    def moves(self) -> bool:
        """Whether the tip is to move or turn at all; what is not a number counts as motion."""
        return any(self.linear_m_s.flat) or any(self.angular_rad_s.flat)


@dataclass(frozen=True)
class Command:
    """One command per arm; an arm that is not named holds still with its grip as it is."""

    arms: Mapping[str, ArmCommand] = field(default_factory=dict)

    def require_valid(self, known_arms: Collection[str]) -> None:
        """Refuse what a world must not carry out.

        Raises:
            ValueError: an arm is unknown or a number is not finite.
        """
        for arm, motion in self.arms.items():
            if arm not in known_arms:
                raise ValueError(f"no arm {arm!r}; this world has {', '.join(known_arms)}")
            if not motion.is_finite:
                raise ValueError(f"the command for {arm} is not finite: {motion}")


HOLD = Command()


class World(Protocol):
    """A place to operate in. One tick: ``observe``, decide, ``command``, ``step``."""

    name: str
    tick_s: float

    @property
    def time_s(self) -> float:
        """World time now. A simulated world waits for its next step; a real one does not."""

    def observe(self) -> Observation:
        """The latest sensor readings; the same object twice if no time passed."""

    def command(self, command: Command) -> None:
        """Set the motion of the coming tick. It ends with the tick: silence is a hold."""

    def step(self) -> None:
        """Let ``tick_s`` of world time pass."""

    def true_force_n(self) -> float | None:
        """Largest true grasp force, for scoring only; None where nobody knows it."""

    def true_surface(self) -> Surface | None:
        """The actual tissue, for pictures only; None where nobody knows it."""

    def close(self) -> None:
        """Let go of all resources; motion is zero from here on."""


@runtime_checkable
class StreamsSetpoints(Protocol):
    """A world that drives real arms, and can tell how regularly."""

    def stream_values(self) -> Mapping[str, Any] | None:
        """The key ``stream`` of ``run.json``: periods and latencies so far; None where nobody can
        tell."""
