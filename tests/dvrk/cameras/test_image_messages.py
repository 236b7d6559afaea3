"""Image and CameraInfo against pixels written by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from defras_bt.dvrk.cameras.depth_pictures import cloud_of
from defras_bt.dvrk.cameras.image_messages import decode_depth, decode_intrinsics, decode_picture
from defras_bt.dvrk.cameras.unusable import Unusable

K = [200.0, 0, 3.0, 0, 210.0, 2.0, 0, 0, 1]


def image(encoding: str, pixels: np.ndarray, pad: int = 0, *, big: bool = False):
    rows = [row.tobytes() + b"\x00" * pad for row in pixels]
    return SimpleNamespace(
        encoding=encoding,
        height=pixels.shape[0],
        width=pixels.shape[1],
        step=len(rows[0]),
        is_bigendian=big,
        data=b"".join(rows),
    )


@pytest.mark.parametrize("encoding", ["rgb8", "bgr8", "rgba8", "bgra8"])
@pytest.mark.parametrize("pad", [0, 5])
def test_every_order_of_channels_comes_out_as_red_green_blue(encoding, pad):
    rgb = np.random.default_rng(2).integers(0, 256, (4, 6, 3)).astype(np.uint8)
    sent = rgb if encoding.startswith("rgb") else rgb[..., ::-1]
    if "a" in encoding:
        sent = np.concatenate([sent, np.full((4, 6, 1), 255, np.uint8)], axis=-1)
    assert np.array_equal(decode_picture(image(encoding, np.ascontiguousarray(sent), pad)), rgb)


@pytest.mark.parametrize("big", [False, True])
def test_depth_comes_in_metres_whatever_the_driver_sends(big):
    order = ">" if big else "<"
    metres = np.array([[0.25, np.nan], [0.0, 0.3]], order + "f4")
    millimetres = np.array([[250, 0], [0, 300]], order + "u2")
    expected = [[0.25, np.nan], [np.nan, 0.3]]
    for message in (
        image("32FC1", metres, big=big),
        image("16UC1", millimetres, pad=2, big=big),
    ):
        assert decode_depth(message) == pytest.approx(np.array(expected), nan_ok=True)


def test_a_cloud_projects_back_onto_its_pixels():
    rng = np.random.default_rng(3)
    depth_m = rng.uniform(0.2, 0.3, (5, 7))
    matrix = decode_intrinsics(SimpleNamespace(K=K, D=[0.0] * 5))
    rgb = np.zeros((5, 7, 3), np.uint8)
    points = cloud_of(depth_m, rgb, matrix).points
    pixels = (points / points[..., 2:]) @ matrix.T
    rows, columns = np.indices(depth_m.shape)
    assert pixels[..., 0] == pytest.approx(columns)
    assert pixels[..., 1] == pytest.approx(rows)
    assert points[..., 2] == pytest.approx(depth_m)
    with pytest.raises(Unusable, match="aligned to depth"):
        cloud_of(depth_m, rgb[:-1], matrix)


def test_pictures_that_cannot_be_used_say_why():
    with pytest.raises(Unusable, match="mono8"):
        decode_picture(image("mono8", np.zeros((2, 2), np.uint8)))
    with pytest.raises(Unusable, match="rgb8"):
        decode_depth(image("rgb8", np.zeros((2, 2, 3), np.uint8)))
    short = image("rgb8", np.zeros((2, 2, 3), np.uint8))
    short.data = short.data[:-1]
    with pytest.raises(Unusable, match="11 bytes"):
        decode_picture(short)
    with pytest.raises(Unusable, match="distorted"):
        decode_intrinsics(SimpleNamespace(k=K, d=[0.1, 0, 0, 0, 0]))
    with pytest.raises(Unusable, match="not calibrated"):
        decode_intrinsics(SimpleNamespace(k=[0.0] * 9, d=[]))
