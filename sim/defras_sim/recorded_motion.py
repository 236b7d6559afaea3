"""RecordedMotion: what the arms were told over a whole recording, as arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Floats, Pose


@dataclass(frozen=True)
class ArmMotion:
    """One arm over n instants, tissue frame.

    ``position_m`` (n, 3), ``rotation`` (n, 3, 3): the set-points tissue_from_tip, as the robot
    believes them. ``grasped`` (n,): whether its jaw held tissue; the first instant of a grip is
    the one at which the tissue is taken.
    """

    position_m: Floats
    rotation: Floats
    grasped: NDArray[np.bool_]

    def tip(self, index: int) -> Pose:
        """tissue_from_tip at one instant."""
        return Pose(self.position_m[index], self.rotation[index])


@dataclass(frozen=True)
class RecordedMotion:
    """Set-points and grips of all arms at ``time_s`` (n,) [s of world time], increasing.

    Raises:
        ValueError: the instants do not increase, or an arm's arrays are of another length or not
            finite.
    """

    time_s: Floats
    arms: Mapping[str, ArmMotion]

    def __post_init__(self) -> None:
        count = len(self.time_s)
        if count == 0 or not np.all(np.diff(self.time_s) > 0) or not np.isfinite(self.time_s).all():
            raise ValueError("a motion needs one instant or more, finite and increasing")
        for name, arm in self.arms.items():
            shapes = (arm.position_m.shape, arm.rotation.shape, arm.grasped.shape)
            if shapes != ((count, 3), (count, 3, 3), (count,)):
                raise ValueError(
                    f"the motion of {name} should have positions ({count}, 3), rotations "
                    f"({count}, 3, 3) and grips ({count},); it has {shapes}"
                )
            if not (np.isfinite(arm.position_m).all() and np.isfinite(arm.rotation).all()):
                raise ValueError(f"the motion of {name} is not finite everywhere")

    def __len__(self) -> int:
        return len(self.time_s)

    def tips(self, index: int) -> dict[str, Pose]:
        """tissue_from_tip of every arm at one instant."""
        return {name: arm.tip(index) for name, arm in self.arms.items()}

    def taken(self, indices: NDArray[np.int64]) -> RecordedMotion:
        """The same motion at some of its instants only."""
        arms = {
            name: ArmMotion(arm.position_m[indices], arm.rotation[indices], arm.grasped[indices])
            for name, arm in self.arms.items()
        }
        return RecordedMotion(self.time_s[indices], arms)
