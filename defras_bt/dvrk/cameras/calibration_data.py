"""What a camera calibration looks at: clouds and pictures out of a bag, an array or an image."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError
from rosbags.highlevel import AnyReader, AnyReaderError

from defras_bt.dvrk.cameras.depth_pictures import SAME_MOMENT_S, cloud_of
from defras_bt.dvrk.cameras.image_messages import decode_depth, decode_intrinsics, decode_picture
from defras_bt.dvrk.cameras.point_cloud import ColouredCloud, decode_cloud
from defras_bt.dvrk.cameras.unusable import Unusable, stamp_s

_IMAGES = (".png", ".jpg", ".jpeg")
_CLOUD, _IMAGE, _INFO = (
    f"sensor_msgs/msg/{kind}" for kind in ("PointCloud2", "Image", "CameraInfo")
)


class NoCameraData(ValueError):
    """There is nothing a camera saw; the message says what was looked for."""


@dataclass(frozen=True)
class CameraView:
    """One moment of one camera: a cloud, a picture, or both. ``source`` says where it is from."""

    source: str
    cloud: ColouredCloud | None = None
    rgb: NDArray[np.uint8] | None = None


def read_views(
    data: Path, most: int = 4, tell: Callable[[str], object] = lambda why: None
) -> list[CameraView]:
    """Up to ``most`` moments of each source, evenly over the time that ``data`` spans.

    ``data``: a bag (ROS 1, ROS 2, MCAP), an .npz of clouds (frames, points, 3), or an image.
    ``tell`` takes a sentence for each topic or array that cannot be used beside those that can.

    Raises:
        NoCameraData: it cannot be read, or holds nothing of the kind.
    """
    if not data.exists():
        raise NoCameraData(f"{data} does not exist; give a bag, an .npz of clouds, or an image")
    if data.suffix.lower() in _IMAGES:
        return [_image(data)]
    left_out: list[str] = []
    read = _arrays if data.suffix == ".npz" else _bag
    views = list(read(data, most, left_out.append))
    if not views:
        whys = "".join(f"; {why}" for why in left_out)
        raise NoCameraData(f"{data} holds neither clouds nor pictures that can be read{whys}")
    for why in left_out:
        tell(why)
    return views


def _image(file: Path) -> CameraView:
    try:
        rgb = np.asarray(Image.open(file).convert("RGB"))
    except (OSError, UnidentifiedImageError) as error:
        raise NoCameraData(f"{file} is no image: {error}") from error
    return CameraView(file.name, rgb=rgb)


def _arrays(file: Path, most: int, tell: Callable[[str], object]) -> Iterator[CameraView]:
    try:
        with np.load(file) as arrays:
            found = {name: np.asarray(arrays[name]) for name in arrays.files}
    # numpy takes what is no archive for a pickle, which it does not load (ValueError), or gives a
    # single array, which is no archive either (TypeError).
    except (OSError, EOFError, ValueError, TypeError, BadZipFile, zlib.error) as error:
        raise NoCameraData(f"{file} is no .npz of numbers: {error}") from error
    for name, frames in found.items():
        if frames.ndim == 2:
            frames = frames[None]
        if frames.ndim != 3 or frames.shape[-1] != 3 or frames.dtype.kind != "f":
            continue
        if not np.isfinite(frames).all(axis=-1).any():
            tell(f"{name} is left out: it holds no measured point")
            continue
        for index in spread(len(frames), most):
            cloud = ColouredCloud(frames[index][None].astype(float), None)
            yield CameraView(f"{name}, frame {index}", cloud)


def _bag(path: Path, most: int, tell: Callable[[str], object]) -> Iterator[CameraView]:
    try:
        with AnyReader([path]) as reader:
            for topic, found in sorted(reader.topics.items()):
                wanted = spread(found.msgcount, most)
                try:
                    if found.msgtype == _CLOUD:
                        for index, message in _messages(reader, topic, wanted):
                            yield CameraView(f"{topic}, message {index}", decode_cloud(message))
                    elif found.msgtype == _IMAGE:
                        yield from _pictures(reader, topic, wanted)
                except Unusable as error:
                    tell(f"{topic} is left out: {error}")
    except (AnyReaderError, OSError) as error:
        raise NoCameraData(f"{path} is no bag that can be read: {error}") from error


def _pictures(reader: AnyReader, topic: str, wanted: list[int]) -> Iterator[CameraView]:
    """Colour pictures; depth pictures with the colours of the same moment, where there are."""
    for index, message in _messages(reader, topic, wanted):
        source = f"{topic}, message {index}"
        if message.encoding not in ("32FC1", "16UC1", "mono16"):
            yield CameraView(source, rgb=decode_picture(message))
            continue
        info = _first(reader, topic, _INFO, lambda _: True)
        if info is None:
            raise Unusable(f"{topic} has depth, but no camera_info beside it says how it sees")
        at_s, shape = stamp_s(message), (message.height, message.width)

        def fits(other: Any, at_s: float = at_s, shape: tuple[int, int] = shape) -> bool:
            same = abs(stamp_s(other) - at_s) <= SAME_MOMENT_S
            return same and (other.height, other.width) == shape and "8" in other.encoding

        colours = _first(reader, topic, _IMAGE, fits)
        depth_m = decode_depth(message)
        if colours is None:
            rgb = np.zeros((*depth_m.shape, 3), np.uint8)
            points = cloud_of(depth_m, rgb, decode_intrinsics(info)).points
            yield CameraView(source, ColouredCloud(points, None))
        else:
            cloud = cloud_of(depth_m, decode_picture(colours), decode_intrinsics(info))
            yield CameraView(source, cloud)


def _messages(reader: AnyReader, topic: str, wanted: list[int]) -> Iterator[tuple[int, Any]]:
    for index, (connection, _, raw) in enumerate(
        reader.messages(connections=reader.topics[topic].connections)
    ):
        if index in wanted:
            yield index, reader.deserialize(raw, connection.msgtype)


def _first(reader: AnyReader, topic: str, kind: str, fits: Callable[[Any], bool]) -> Any | None:
    """The first message of a kind that fits, of the same camera: its topics begin alike."""
    camera = topic.strip("/").split("/")[0]
    connections = [
        c for c in reader.connections
        if c.msgtype == kind and c.topic != topic and c.topic.strip("/").split("/")[0] == camera
    ]  # fmt: skip
    if not connections:
        return None
    for connection, _, raw in reader.messages(connections=connections):
        message = reader.deserialize(raw, connection.msgtype)
        if fits(message):
            return message
    return None


def spread(count: int, most: int) -> list[int]:
    """At most ``most`` of 0 .. ``count`` - 1, evenly spread.

    >>> spread(10, 4), spread(2, 4), spread(0, 4)
    ([0, 3, 6, 9], [0, 1], [])
    """
    return sorted({round(x) for x in np.linspace(0, count - 1, min(count, most))})
