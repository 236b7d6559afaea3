"""PointCloud2 against records written by hand, in every layout that drivers use."""

from types import SimpleNamespace

import numpy as np
import pytest

from defras_bt.dvrk.cameras.point_cloud import decode_cloud
from defras_bt.dvrk.cameras.unusable import Unusable, require_frame, require_metres, stamp_s

KINDS = {"f4": 7, "f8": 8, "u1": 2, "u4": 6}


def cloud_message(record: np.dtype, rows: np.ndarray, *, big: bool = False, pad: int = 0):
    """A message of ``rows`` (h, w) of ``record``, each row followed by ``pad`` bytes."""
    height, width = rows.shape
    fields = [
        SimpleNamespace(name=name, offset=offset, datatype=KINDS[kind.str[1:]], count=1)
        for name, (kind, offset) in ((n, record.fields[n][:2]) for n in record.names)
    ]
    data = b"".join(row.tobytes() + b"\x00" * pad for row in rows)
    return SimpleNamespace(
        height=height,
        width=width,
        fields=fields,
        is_bigendian=big,
        point_step=record.itemsize,
        row_step=record.itemsize * width + pad,
        data=data,
        header=SimpleNamespace(stamp=SimpleNamespace(secs=5, nsecs=500_000_000), frame_id="/cam"),
    )


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("kind", ["f4", "f8"])
@pytest.mark.parametrize("pad", [0, 12])
def test_points_and_packed_colours_come_back(order, kind, pad):
    rng = np.random.default_rng(1)
    record = np.dtype(
        {
            "names": ["x", "y", "z", "rgb"],
            "formats": [order + kind, order + kind, order + kind, order + "u4"],
            "offsets": [4, 12, 20, 28],
            "itemsize": 48,
        }
    )
    rows = np.zeros((3, 5), record)
    points = rng.uniform(0.1, 0.4, (3, 5, 3)).astype(kind)
    rows["x"], rows["y"], rows["z"] = np.moveaxis(points, -1, 0)
    rgb = rng.integers(0, 256, (3, 5, 3))
    rows["rgb"] = rgb[..., 0] * 65536 + rgb[..., 1] * 256 + rgb[..., 2]
    found = decode_cloud(cloud_message(record, rows, big=order == ">", pad=pad))
    assert found.points == pytest.approx(points.astype(float))
    assert np.array_equal(found.rgb, rgb)
    assert found.is_picture


def test_what_was_not_measured_is_nan_and_colours_are_optional():
    record = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4")])
    rows = np.zeros((1, 2), record)
    rows[0, 1]["y"] = np.inf
    found = decode_cloud(cloud_message(record, rows))
    assert np.isnan(found.points[0, 1]).all()
    assert np.isfinite(found.points[0, 0]).all()
    assert found.rgb is None
    assert not found.is_picture


def test_separate_channels_are_colours_too():
    record = np.dtype([(n, "<f4") for n in "xyz"] + [(n, "u1") for n in "rgb"])
    rows = np.zeros((1, 1), record)
    rows[0, 0]["r"], rows[0, 0]["b"] = 200, 7
    assert decode_cloud(cloud_message(record, rows)).rgb[0, 0].tolist() == [200, 0, 7]


def test_clouds_that_are_not_whole_are_refused():
    record = np.dtype([(n, "<f4") for n in "xyz"])
    message = cloud_message(record, np.zeros((2, 4), record))
    message.data = message.data[:-1]
    with pytest.raises(Unusable, match="needs 96 bytes and has 95"):
        decode_cloud(message)
    other = np.dtype([("x", "<f4"), ("y", "<f4"), ("intensity", "<f4")])
    with pytest.raises(Unusable, match=r"x, y, z .* intensity"):
        decode_cloud(cloud_message(other, np.zeros((1, 1), other)))


def test_units_frames_and_stamps_are_checked():
    require_metres(np.array([0.2, np.nan, 0.3]), "cloud")
    with pytest.raises(Unusable, match="look like millimetres"):
        require_metres(np.array([215.0, 240.0]), "cloud")
    with pytest.raises(Unusable, match="no measured point"):
        require_metres(np.array([np.nan]), "cloud")
    record = np.dtype([(n, "<f4") for n in "xyz"])
    message = cloud_message(record, np.zeros((1, 1), record))
    require_frame(message, "cam")
    with pytest.raises(Unusable, match=r"frame '/cam'; the set-up says 'map'"):
        require_frame(message, "map")
    assert stamp_s(message) == 5.5
    message.header.stamp.secs = message.header.stamp.nsecs = 0
    with pytest.raises(Unusable, match="stamp is 0"):
        stamp_s(message)
