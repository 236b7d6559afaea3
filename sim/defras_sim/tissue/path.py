"""The way of the tips: how far a motion is, poses in between, and where the tissue goes next."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from defras_sim.geometry import Floats, Pose

# A pose as three points: its origin, and two 20 mm off. Their motion measures turns, too.
_MARKERS_M: Floats = np.array([[0.0, 0.0, 0.0], [0.02, 0.0, 0.0], [0.0, 0.02, 0.0]])
# Extrapolating farther than the last step was long, or around a corner, is guessing.
_FARTHEST_SHARE = 2.0
_SMALLEST_COSINE = 0.7


def markers_m(tips: Mapping[str, Pose]) -> Floats:
    """Points (3 tips, 3) that stand for the poses, in the order of the arms' names."""
    points = [tips[arm].apply(_MARKERS_M) for arm in sorted(tips)]
    return np.concatenate([np.zeros((0, 3)), *points])


def length_m(start: Mapping[str, Pose], end: Mapping[str, Pose]) -> float:
    """Way of the marker that moves farthest."""
    ways = np.linalg.norm(markers_m(end) - markers_m(start), axis=1)
    return float(ways.max(initial=0.0))


def between(start: Pose, end: Pose, share: float) -> Pose:
    """The pose at ``share`` (0..1) of the way, turning about one axis."""
    if share >= 1.0:
        return end
    turn = Rotation.from_matrix(end.rotation @ start.rotation.T).as_rotvec()
    rotation = Rotation.from_rotvec(share * turn).as_matrix() @ start.rotation
    return Pose(start.position_m + share * (end.position_m - start.position_m), rotation)


class Trail:
    """The last three equilibria and the tips they belong to.

    Extrapolated quadratically they give a start for the next equilibrium that saves most of
    Newton's iterations: 1.3 instead of 3.3 a step of 1 mm (8x8x1 elements).
    """

    def __init__(self) -> None:
        self._steps: deque[tuple[Floats, Floats]] = deque(maxlen=3)

    def clear(self) -> None:
        self._steps.clear()

    def add(self, tips_m: Floats, positions_m: Floats) -> None:
        """Remember an equilibrium at markers ``tips_m``; a tip that did not move replaces it."""
        if self._steps and np.allclose(self._steps[-1][0], tips_m, rtol=0, atol=1e-9):
            self._steps.pop()
        self._steps.append((tips_m, positions_m))

    def guesses(self, tips_m: Floats) -> list[Floats]:
        """Positions (nodes, 3) expected at markers ``tips_m``, linear and quadratic; maybe none."""
        if len(self._steps) < 2:
            return []
        tips, positions = zip(*reversed(self._steps), strict=True)
        ahead, last = tips_m - tips[0], tips[0] - tips[1]
        s, h1 = float(np.linalg.norm(ahead)), float(np.linalg.norm(last))
        if s > _FARTHEST_SHARE * h1 or np.sum(ahead * last) < _SMALLEST_COSINE * s * h1:
            return []
        linear = positions[0] + s / h1 * (positions[0] - positions[1])
        if len(self._steps) < 3:
            return [linear]
        h2 = h1 + float(np.linalg.norm(tips[1] - tips[2]))
        # Lagrange's parabola through the equilibria at 0, -h1 and -h2.
        weights = (
            (s + h1) * (s + h2) / (h1 * h2),
            -s * (s + h2) / (h1 * (h2 - h1)),
            s * (s + h1) / (h2 * (h2 - h1)),
        )
        return [linear, sum(w * p for w, p in zip(weights, positions, strict=True))]
