"""Image and CameraInfo messages as arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from defras_bt.dvrk.cameras.unusable import Unusable
from defras_sim.geometry import Floats

_CHANNELS = {"rgb8": (0, 1, 2), "bgr8": (2, 1, 0), "rgba8": (0, 1, 2), "bgra8": (2, 1, 0)}
_DISTORTED = 1e-6


def decode_picture(message: Any) -> NDArray[np.uint8]:
    """Red, green, blue (h, w, 3) of an Image.

    Raises:
        Unusable: it is not of colours, or has less data than it says.
    """
    order = _CHANNELS.get(message.encoding)
    if order is None:
        raise Unusable(
            f"a colour picture of encoding {message.encoding!r}; known are {', '.join(_CHANNELS)}"
        )
    channels = 4 if "a" in message.encoding else 3
    pixels = _pixels(message, np.dtype("u1"), channels)
    return np.ascontiguousarray(pixels[..., order])


def decode_depth(message: Any) -> Floats:
    """Depths (h, w) [m] along the optical axis, NaN where nothing was measured.

    As ROS has it: floats are metres, 16-bit integers are millimetres and 0 says nothing.

    Raises:
        Unusable: it is no depth picture, or has less data than it says.
    """
    order = ">" if message.is_bigendian else "<"
    if message.encoding == "32FC1":
        depth_m = _pixels(message, np.dtype(order + "f4"), 1)[..., 0].astype(float)
    elif message.encoding in ("16UC1", "mono16"):
        depth_m = 1e-3 * _pixels(message, np.dtype(order + "u2"), 1)[..., 0].astype(float)
    else:
        raise Unusable(
            f"a depth picture of encoding {message.encoding!r}; known are 32FC1 (m), 16UC1 (mm)"
        )
    depth_m[~np.isfinite(depth_m) | (depth_m <= 0.0)] = np.nan
    return depth_m


def decode_intrinsics(info: Any) -> Floats:
    """Matrix (3, 3) from camera coordinates to pixels of a CameraInfo.

    Raises:
        Unusable: the camera is not calibrated, or its pictures are distorted.
    """
    # rosbags spells the fields of ROS 2 in small letters.
    matrix = np.asarray(info.K if hasattr(info, "K") else info.k, float).reshape(3, 3)
    distortion = np.asarray(info.D if hasattr(info, "D") else info.d, float)
    if matrix[0, 0] <= 0.0 or matrix[1, 1] <= 0.0:
        raise Unusable("the camera is not calibrated: its info has no focal length")
    if np.any(np.abs(distortion) > _DISTORTED):
        raise Unusable(
            "its pictures are distorted by the lens; give the topics of rectified pictures "
            "(image_rect) and their info"
        )
    return matrix


def _pixels(message: Any, kind: np.dtype[Any], channels: int) -> NDArray[Any]:
    """(h, w, channels); rows may be padded at their ends."""
    height, width, step = int(message.height), int(message.width), int(message.step)
    data = message.data
    data = data if isinstance(data, bytes) else np.asarray(data, np.uint8).tobytes()
    size = channels * kind.itemsize
    if width * size > step or len(data) < step * height:
        raise Unusable(
            f"a picture of {width} x {height} in {message.encoding} with rows of {step} bytes has "
            f"{len(data)} bytes"
        )
    return np.ndarray(
        (height, width, channels), kind, buffer=data, strides=(step, size, kind.itemsize)
    )
