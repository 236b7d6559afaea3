"""A camera's message that must not be acted on, and what all cameras' messages must keep to."""

from __future__ import annotations

from typing import Any

import numpy as np

from defras_sim.geometry import Floats

NEAREST_M, FARTHEST_M = 0.02, 5.0
"""Tissue in an operating theatre is not nearer to a camera, nor farther away."""


class Unusable(ValueError):
    """A message that must not be used; the text says why, and what would be valid."""


def stamp_s(message: Any) -> float:
    """The stamp in seconds, of a message of rospy or of rosbags.

    Raises:
        Unusable: it is 0, which says that the driver does not know the time.
    """
    stamp = message.header.stamp
    seconds = stamp.secs if hasattr(stamp, "secs") else stamp.sec
    nanoseconds = stamp.nsecs if hasattr(stamp, "nsecs") else stamp.nanosec
    found = float(seconds) + 1e-9 * float(nanoseconds)
    if found == 0.0:
        raise Unusable("its stamp is 0: the driver gives no time of measurement")
    return found


def require_frame(message: Any, frame: str) -> None:
    """See that a message comes in the frame that the set-up says.

    Raises:
        Unusable: it comes in another one.
    """
    found = message.header.frame_id
    if found.lstrip("/") != frame.lstrip("/"):
        raise Unusable(f"it comes in the frame {found!r}; the set-up says {frame!r}")


def require_metres(distances: Floats, what: str) -> None:
    """See that distances (n,) from the camera are metres.

    Raises:
        Unusable: nothing was measured, or the distances are of no theatre.
    """
    finite = distances[np.isfinite(distances)]
    if len(finite) == 0:
        raise Unusable(f"the {what} holds no measured point")
    median_m = float(np.median(finite))
    if NEAREST_M <= median_m <= FARTHEST_M:
        return
    likely = ""
    if NEAREST_M <= 1e-3 * median_m <= FARTHEST_M:
        likely = "; these look like millimetres"
    raise Unusable(
        f"the {what}'s points are {median_m:.4g} away in the middle, where metres between "
        f"{NEAREST_M:g} and {FARTHEST_M:g} are needed{likely}"
    )
