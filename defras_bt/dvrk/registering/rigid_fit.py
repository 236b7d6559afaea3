"""The rigid motion that brings one set of points onto another, and how far to trust it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defras_sim.geometry import Floats, Pose

FEWEST = 4
"""Three points fix a pose; from the fourth on residuals say something about it."""
_FLAT = 0.05
"""Landmarks on a line, or nearly: the second extent is less than this share of the first."""


class NotRegistered(ValueError):
    """These landmarks fix no pose; the message says why."""


@dataclass(frozen=True)
class RigidFit:
    """``parent_from_child`` and what speaks for it.

    ``residuals_m`` (n,): from each landmark to where the pose puts it. ``left_out_m`` (n,): the
    same, with the pose fitted to all the others; what a new point is off by. ``scale``: how much
    larger the parent's landmarks lie apart than the child's, 1 where both are in metres.
    """

    parent_from_child: Pose
    residuals_m: Floats
    left_out_m: Floats
    scale: float

    @property
    def rms_m(self) -> float:
        """Root of the mean squared residual."""
        return float(np.sqrt(np.mean(self.residuals_m**2)))

    @property
    def worst_left_out_m(self) -> float:
        return float(self.left_out_m.max())


def rigid_fit(parent_m: Floats, child_m: Floats) -> RigidFit:
    """The least-squares pose that maps ``child_m`` (n, 3) onto ``parent_m`` (n, 3).

    Kabsch 1976, with the reflection excluded. Landmarks in one plane are fine, on one line are not.

    Raises:
        NotRegistered: too few landmarks, on one line, not numbers, or of different scale.
    """
    parent, child = np.asarray(parent_m, float), np.asarray(child_m, float)
    if parent.shape != child.shape or parent.ndim != 2 or parent.shape[1] != 3:
        raise NotRegistered(f"landmarks of shapes {parent.shape} and {child.shape}, not (n, 3)")
    if len(parent) < FEWEST:
        raise NotRegistered(
            f"{len(parent)} landmarks; at least {FEWEST} are needed, or nothing tells an error"
        )
    if not (np.isfinite(parent).all() and np.isfinite(child).all()):
        raise NotRegistered("a landmark is not a number")
    for points, whose in ((parent, "where they are"), (child, "where they were touched or seen")):
        extents = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        if extents[1] <= _FLAT * extents[0]:
            raise NotRegistered(
                f"the landmarks, {whose}, lie on one line; take one well beside the others"
            )
    scale = float(np.sqrt(_spread(parent) / _spread(child)))
    if not 0.8 < scale < 1.25:
        hint = " (one of them in millimetres?)" if not 0.01 < scale < 100 else ""
        raise NotRegistered(
            f"the landmarks lie {1 / scale:.3g} times as far apart as they should{hint}"
        )
    pose = _kabsch(parent, child)
    left_out = [
        _missed_m(_kabsch(np.delete(parent, i, 0), np.delete(child, i, 0)), parent, child)[i]
        for i in range(len(parent))
    ]
    return RigidFit(pose, _missed_m(pose, parent, child), np.array(left_out), scale)


def _kabsch(parent_m: Floats, child_m: Floats) -> Pose:
    middle, child_middle = parent_m.mean(axis=0), child_m.mean(axis=0)
    u, _, vt = np.linalg.svd((parent_m - middle).T @ (child_m - child_middle))
    turn = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    return Pose(middle - turn @ child_middle, turn)


def _missed_m(pose: Pose, parent_m: Floats, child_m: Floats) -> Floats:
    return np.linalg.norm(pose.apply(child_m) - parent_m, axis=1)


def _spread(points_m: Floats) -> float:
    return float(np.sum((points_m - points_m.mean(axis=0)) ** 2))
