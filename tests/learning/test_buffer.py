"""Which shapes the buffer keeps."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.learning.buffer import KeyframeBuffer
from defras_sim.geometry import Pose
from defras_sim.worlds.protocol import PointCloud

GRASP = Pose(np.array([0.03, 0.0, 0.0]))


def tip_at(height_m: float) -> Pose:
    return GRASP.moved(np.array([0.0, 0.0, height_m]))


def cloud_at(stamp_s: float) -> PointCloud:
    return PointCloud(stamp_s, np.full((30, 3), stamp_s))


def lifted(buffer: KeyframeBuffer, ticks: int, start: int = 0) -> None:
    """A lift of 0.75 mm per tick of 50 ms, a cloud every other tick."""
    for tick in range(start, start + ticks):
        cloud = cloud_at(0.05 * (tick - tick % 2))
        buffer.add(0.05 * tick, {"psm1": GRASP}, {"psm1": tip_at(0.00075 * tick)}, cloud)


def test_frames_are_few_and_spread_over_the_whole_way() -> None:
    buffer = KeyframeBuffer(capacity=5)
    lifted(buffer, 60)
    heights = [frame.tips["psm1"].position_m[2] for frame in buffer.frames()]
    assert 4 <= len(heights) <= 6
    assert heights[0] == pytest.approx(0.0)
    assert heights[-1] == pytest.approx(0.00075 * 58)
    assert np.diff(heights).min() > 0.002
    assert np.diff(heights).max() < 0.02


def test_the_newest_cloud_is_the_last_frame() -> None:
    buffer = KeyframeBuffer()
    for ticks in range(1, 40):
        lifted(buffer, 1, start=ticks - 1)
        assert buffer.frames()[-1].stamp_s == pytest.approx(0.05 * ((ticks - 1) // 2 * 2))


def test_a_cloud_is_paired_with_the_tips_at_its_time() -> None:
    buffer = KeyframeBuffer()
    for tick in range(10):
        buffer.add(0.05 * tick, {"psm1": GRASP}, {"psm1": tip_at(0.001 * tick)}, None)
    buffer.add(0.5, {"psm1": GRASP}, {"psm1": tip_at(0.01)}, cloud_at(0.225))
    assert buffer.frames()[-1].tips["psm1"].position_m[2] == pytest.approx(0.0045)


def test_a_cloud_from_before_the_grasp_is_not_used() -> None:
    buffer = KeyframeBuffer()
    buffer.add(1.0, {"psm1": GRASP}, {"psm1": GRASP}, cloud_at(0.95))
    assert buffer.frames() == ()


def test_a_new_grasp_starts_again() -> None:
    buffer = KeyframeBuffer()
    lifted(buffer, 30)
    buffer.add(3.0, {"psm1": tip_at(0.001)}, {"psm1": tip_at(0.001)}, cloud_at(3.0))
    assert [frame.stamp_s for frame in buffer.frames()] == [3.0]


def test_clear_forgets() -> None:
    buffer = KeyframeBuffer()
    lifted(buffer, 30)
    buffer.clear()
    assert buffer.frames() == ()


SECOND = Pose(np.array([-0.03, -0.03, 0.002]))


def test_a_second_arm_starts_again_from_the_moment_it_joins() -> None:
    buffer = KeyframeBuffer(capacity=3)
    lifted(buffer, 30)
    for tick in range(30, 90):
        tips = {"psm1": tip_at(0.0225), "psm2": SECOND.moved(np.array([0, 0, 5e-4]) * (tick - 30))}
        buffer.add(0.05 * tick, {"psm1": GRASP, "psm2": SECOND}, tips, cloud_at(0.05 * tick))
    frames = buffer.frames()
    assert all(set(frame.tips) == {"psm1", "psm2"} for frame in frames)
    assert frames[0].tips["psm2"].position_m[2] == pytest.approx(0.002)


def test_nothing_is_kept_while_a_grasp_cannot_be_repeated() -> None:
    buffer = KeyframeBuffer()
    lifted(buffer, 30)
    both = {"psm1": GRASP, "psm2": SECOND}
    buffer.add(1.5, both, both, cloud_at(1.5))
    buffer.clear()
    for tick in range(31, 50):
        buffer.add(0.05 * tick, {"psm2": SECOND}, {"psm2": SECOND}, cloud_at(0.05 * tick))
    assert buffer.frames() == ()
    buffer.add(3.0, {"psm1": tip_at(0.001)}, {"psm1": tip_at(0.001)}, cloud_at(3.0))
    assert len(buffer.frames()) == 1


def test_mappings_of_different_arms_and_a_tiny_capacity_are_refused() -> None:
    with pytest.raises(ValueError, match="grasp tips of"):
        KeyframeBuffer().add(0.0, {"psm1": GRASP}, {}, None)
    with pytest.raises(ValueError, match="3 frames or more"):
        KeyframeBuffer(capacity=2)
