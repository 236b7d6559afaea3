"""When an effect that begins during the motion may have begun."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from defras_bt.diagnosis.twins.tissue_gains import Gains
from defras_bt.diagnosis.twins.tissue_part import TissuePart
from defras_sim.geometry import Floats


class Onsets:
    """Times between two frames in which tissue is held: at which of them something began cannot be
    known, and makes no difference, any finer."""

    def __init__(self, parts: Sequence[TissuePart], gains: Gains) -> None:
        self._gains = gains
        times: list[Floats] = []
        for part in parts:
            motion, time_s = part.trajectory.motion, part.trajectory.time_s
            held = np.any([arm.grasped for arm in motion.arms.values()], axis=0)
            ends = np.flatnonzero(held[part.trajectory.frames[1:]])
            times.append((time_s[ends] + time_s[ends + 1]) / 2)
        self._times_s = np.unique(np.concatenate(times))

    def spread(self, count: int) -> list[float]:
        """``count`` times spread over all."""
        return [float(self._times_s[i]) for i in self._places(count)]

    def columns(
        self, count: int, column_from: Callable[[float], Floats]
    ) -> list[tuple[float, Floats]]:
        """What would change with a beginning at each of ``count`` times and of more around the best
        of them, down to neighbouring frames: a jump that is dated wrongly by a few frames explains
        little. ``column_from`` gives the change (n,) by time."""
        found = {i: column_from(float(self._times_s[i])) for i in self._places(count)}
        if not found:
            return []
        gain = {i: self._gains.of(column) for i, column in found.items()}
        gap = len(self._times_s) // (count + 1)
        while gap >= 1:
            best = max(gain, key=lambda i: gain[i])
            beside = [i for i in (best - gap, best + gap) if 0 <= i < len(self._times_s)]
            for i in beside:
                if i not in found:
                    found[i] = column_from(float(self._times_s[i]))
                    gain[i] = self._gains.of(found[i])
            if all(gain[i] <= gain[best] for i in beside):
                gap //= 2
        return [(float(self._times_s[i]), found[i]) for i in sorted(found)]

    def _places(self, count: int) -> list[int]:
        if len(self._times_s) == 0:
            return []
        at = np.linspace(0, len(self._times_s) - 1, count + 2)[1:-1]
        return sorted({int(i) for i in at})
