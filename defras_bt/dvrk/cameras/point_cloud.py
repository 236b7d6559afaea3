"""PointCloud2 messages as arrays, without a loop over points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defras_bt.dvrk.cameras.unusable import Unusable
from defras_sim.geometry import Floats

_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
"""sensor_msgs/PointField.datatype."""


@dataclass(frozen=True)
class ColouredCloud:
    """Points (h, w, 3) as the camera gives them, NaN where nothing was measured.

    ``rgb`` (h, w, 3) of uint8, None for a cloud without colours. A cloud without rows has h = 1:
    neighbours in it are then no neighbours in the picture.
    """

    points: Floats
    rgb: NDArray[np.uint8] | None

    @property
    def is_picture(self) -> bool:
        """Whether its rows are those of a picture."""
        return self.points.shape[0] > 1


def decode_cloud(message: Any) -> ColouredCloud:
    """Points and colours of a PointCloud2 of rospy or of rosbags.

    Raises:
        Unusable: it has no x, y, z in floats, or less data than it says.
    """
    shape = (int(message.height), int(message.width))
    fields = {field.name: field for field in message.fields}
    missing = [name for name in "xyz" if name not in fields]
    if missing or any(fields[name].datatype not in (7, 8) for name in "xyz"):
        there = ", ".join(fields) or "none"
        raise Unusable(f"a cloud needs the fields x, y, z as floats; it has {there}")
    data = _bytes(message.data)
    rows = _rows(message, shape, fields, data)
    points = np.stack([rows[name].astype(float) for name in "xyz"], axis=-1)
    points[~np.isfinite(points).all(axis=-1)] = np.nan
    return ColouredCloud(points, _colours(rows))


def _rows(
    message: Any, shape: tuple[int, int], fields: Mapping[str, Any], data: bytes
) -> NDArray[np.void]:
    """One record per point, of the fields that are needed; rows may be padded at their ends."""
    height, width = shape
    order = ">" if message.is_bigendian else "<"
    wanted = [name for name in ("x", "y", "z", "rgb", "rgba", "r", "g", "b") if name in fields]
    step, row_step = int(message.point_step), int(message.row_step) or width * message.point_step
    unknown = {
        name: fields[name].datatype for name in wanted if fields[name].datatype not in _TYPES
    }
    if unknown:
        raise Unusable(f"the cloud has fields of unknown types: {unknown}")
    record = np.dtype(
        {
            "names": wanted,
            "formats": [_format(name, order, fields[name].datatype) for name in wanted],
            "offsets": [int(fields[name].offset) for name in wanted],
            "itemsize": step,
        }
    )
    needed = (height - 1) * row_step + width * step if height and width else 0
    if len(data) < needed:
        raise Unusable(
            f"the cloud of {height} x {width} points needs {needed} bytes and has {len(data)}"
        )
    return np.ndarray(shape, record, buffer=data, strides=(row_step, step))


def _format(name: str, order: str, datatype: int) -> str:
    """Packed colours are 32 bits, whatever type they pretend to be of."""
    return order + ("u4" if name in ("rgb", "rgba") else _TYPES[datatype])


def _colours(rows: NDArray[np.void]) -> NDArray[np.uint8] | None:
    names = rows.dtype.names or ()
    for packed in ("rgb", "rgba"):
        if packed in names:
            value = rows[packed]
            channels = [(value >> shift) & 0xFF for shift in (16, 8, 0)]
            return np.stack(channels, axis=-1).astype(np.uint8)
    if all(name in names for name in "rgb"):
        return np.stack([rows[name].astype(np.uint8) for name in "rgb"], axis=-1)
    return None


def _bytes(data: Any) -> bytes:
    return data if isinstance(data, bytes) else np.asarray(data, np.uint8).tobytes()
