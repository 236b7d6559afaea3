"""The clouds of a recording: finite points near the tissue, from a camera that is alive."""

from __future__ import annotations

import numpy as np

from defras_bt.diagnosis.quality import Mask
from defras_bt.diagnosis.topic_map import LengthSource
from defras_bt.diagnosis.topic_reader import TopicReader, UnusableRecording
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.worlds.protocol import PointCloud

FEWEST_POINTS = 50
"""A cloud of fewer points says nothing about a shape."""
AROUND_M = 0.06
"""Points farther from the box around the resting tissue belong to something else. Tissue is lifted
by up to its own size, so upwards the box is as high as the tissue is long."""


def read_clouds(reader: TopicReader, source: LengthSource, scene: Scene) -> tuple[PointCloud, ...]:
    """Clouds in the tissue frame, in order of time.

    Raises:
        UnusableRecording: none is left.
    """
    series, sieve, tissue_from_frame = reader.series(source)
    raw = [np.asarray(points, float) * source.scale for points in series.points_m]
    frozen = np.array(
        [i > 0 and np.array_equal(raw[i], raw[i - 1], equal_nan=True) for i in range(len(raw))]
    )
    sieve.leave_out(frozen, "frozen", "the camera repeats its last cloud")
    finite = [
        points[np.isfinite(points).all(axis=1) & np.any(points != 0.0, axis=1)] for points in raw
    ]
    placed = [tissue_from_frame.apply(points) for points in finite]
    filled = [points for points in placed if len(points)]
    if filled:
        reader.require_near(source, np.concatenate(filled))
    near = [points[_near(points, scene)] for points in placed]
    lost = sum(len(before) - len(after) for before, after in zip(raw, finite, strict=True))
    if lost:
        sieve.report("not_finite", (), f"{lost} points without a place, all left out")
    beyond = sum(len(before) - len(after) for before, after in zip(placed, near, strict=True))
    if beyond:
        sieve.report("outlier", (), f"{beyond} points that are not on the tissue, all left out")
    few = np.array([len(points) < FEWEST_POINTS for points in near])
    sieve.leave_out(few, "missing", f"clouds of fewer than {FEWEST_POINTS} points on the tissue")
    times = reader.times_s(source, series)
    reader.keep(sieve, times[sieve.kept])
    kept = np.flatnonzero(sieve.kept)
    if len(kept) == 0:
        raise UnusableRecording(f"no cloud of {source.topic} can be used")
    return tuple(PointCloud(float(times[i]), near[i]) for i in kept)


def _near(points_m: Floats, scene: Scene) -> Mask:
    """Points (n,) in the box around everywhere that the tissue can be."""
    tissue = scene.tissue
    size = max(tissue.length_x_m, tissue.width_y_m)
    half = np.array([tissue.length_x_m / 2, tissue.width_y_m / 2]) + AROUND_M
    inside = (np.abs(points_m[:, :2]) <= half).all(axis=1)
    height = points_m[:, 2]
    return np.asarray(
        inside & (height <= size + AROUND_M) & (height >= -tissue.thickness_m - AROUND_M)
    )
