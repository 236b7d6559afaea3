"""A few well-spread observed shapes since the last grasp, for whoever learns from them."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from math import dist

import numpy as np

from defras_bt.learning.estimate import Keyframe
from defras_sim.geometry import Pose
from defras_sim.worlds.protocol import PointCloud

_HISTORY_S = 1.0


@dataclass(frozen=True)
class _Grip:
    """Where an arm took the tissue, and which other arms deformed it at that time."""

    tip: Pose
    beside: frozenset[str]


class KeyframeBuffer:
    """Keeps about ``capacity`` frames, spread along the way of the holding tips.

    Call :meth:`add` every tick in which tissue is held. A frame is taken when a new cloud arrives
    after a holding tip moved by ``spacing_m``; when there are too many, the one closest to its
    neighbours goes. Frames are of one set of holding arms: a grasp or a release starts anew. As
    long as an arm holds tissue that it took beside another arm that has let go since, nothing is
    kept, for that grasp cannot be repeated on a model.
    """

    def __init__(self, capacity: int = 5, spacing_m: float = 0.005) -> None:
        if capacity < 3:
            raise ValueError(f"capacity {capacity} is too small; learning needs 3 frames or more")
        self._capacity = capacity
        self._spacing_m = spacing_m
        self._grips: dict[str, _Grip] = {}
        self.clear()

    def clear(self) -> None:
        """Forget all frames, as after a grasp or a release."""
        self._kept: list[Keyframe] = []
        self._latest: Keyframe | None = None
        self._tips: deque[tuple[float, Mapping[str, Pose]]] = deque()

    def add(
        self,
        time_s: float,
        grasp_tips: Mapping[str, Pose],
        tips: Mapping[str, Pose],
        cloud: PointCloud | None,
    ) -> None:
        """Take note of one tick.

        Both mappings hold tissue_from_tip of the holding arms only: when each jaw closed, and now.
        The cloud may be older than the tick: it is paired with the tips at its own time.

        Raises:
            ValueError: the mappings name different arms.
        """
        if set(grasp_tips) != set(tips):
            raise ValueError(f"grasp tips of {sorted(grasp_tips)} but tips of {sorted(tips)}")
        if self._regripped(grasp_tips):
            self.clear()
        self._tips.append((time_s, dict(tips)))
        while self._tips[0][0] < time_s - _HISTORY_S:
            self._tips.popleft()
        if cloud is None or not tips or not self._repeatable or cloud.stamp_s < self._tips[0][0]:
            return
        if self._latest is not None and cloud.stamp_s <= self._latest.stamp_s:
            return
        then = self._tips_at(cloud.stamp_s)
        self._latest = Keyframe(cloud.stamp_s, dict(grasp_tips), then, cloud.points_m)
        if not self._kept or _gap_m(self._kept[-1], self._latest) >= self._spacing_m:
            self._kept.append(self._latest)
            self._thin_out()

    def frames(self) -> tuple[Keyframe, ...]:
        """The kept frames in order of time; the newest cloud is always the last one."""
        if self._latest is None:
            return ()
        kept = [frame for frame in self._kept if frame is not self._latest]
        if len(kept) > 1 and _gap_m(kept[-1], self._latest) < self._spacing_m / 2:
            kept.pop()
        return (*kept, self._latest)

    @property
    def _repeatable(self) -> bool:
        return all(grip.beside <= set(self._grips) for grip in self._grips.values())

    def _regripped(self, grasp_tips: Mapping[str, Pose]) -> bool:
        """Keep track of who took the tissue beside whom; True if anything changed."""
        kept = {
            arm: grip
            for arm, grip in self._grips.items()
            if arm in grasp_tips and np.array_equal(grip.tip.position_m, grasp_tips[arm].position_m)
        }
        fresh = set(grasp_tips) - set(kept)
        changed = bool(fresh) or len(kept) < len(self._grips)
        taken = {arm: _Grip(grasp_tips[arm], frozenset(kept)) for arm in fresh}
        self._grips = {**kept, **taken}
        return changed

    def _tips_at(self, stamp_s: float) -> dict[str, Pose]:
        """Tips at ``stamp_s``, between two ticks; turns within a tick are too small to matter."""
        times = [time for time, _ in self._tips]
        after = int(np.searchsorted(times, stamp_s))
        if after == 0 or after == len(times):
            return dict(self._tips[min(after, len(times) - 1)][1])
        (start, first), (end, second) = self._tips[after - 1], self._tips[after]
        share = (stamp_s - start) / (end - start)
        return {
            arm: second[arm].moved((1 - share) * (first[arm].position_m - second[arm].position_m))
            for arm in second
        }

    def _thin_out(self) -> None:
        frames = self._kept
        while len(frames) > self._capacity:
            crowding = [
                _gap_m(before, frame) + _gap_m(frame, after)
                for before, frame, after in zip(frames, frames[1:], frames[2:], strict=False)
            ]
            del frames[1 + int(np.argmin(crowding))]


def _gap_m(one: Keyframe, other: Keyframe) -> float:
    """Largest way of a tip between two frames."""
    return max(
        dist(one.tips[arm].position_m.tolist(), other.tips[arm].position_m.tolist())
        for arm in one.tips
    )
