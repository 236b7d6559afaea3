"""Which grasp points expose the region, if the scene's attachments are the true ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from defras_sim.retraction import SEQUENCES, GraspPoint, Rehearsal, Rehearser
from defras_sim.scene import Scene


def grasp_points(scene: Scene) -> list[GraspPoint]:
    """All grasp points, the one closest to the region of interest first."""
    points = [
        (column, row)
        for row in range(1, scene.grasp.rows + 1)
        for column in range(1, scene.grasp.columns + 1)
    ]
    roi_xy_m = scene.roi_center_m[:2]
    return sorted(
        points, key=lambda p: (float(np.linalg.norm(scene.grasp_xy_m(*p) - roi_xy_m).round(9)), p)
    )


def best_rehearsals(
    scene: Scene, points: Sequence[GraspPoint], *, step_m: float = 0.004
) -> Iterator[Rehearsal]:
    """For each point the rehearsal that shows most of the region, over :data:`SEQUENCES`.

    A point is done as soon as one sequence exposes the region.
    """
    rehearser = Rehearser(scene, step_m=step_m, stop_when_exposed=True)
    for point in points:
        best: Rehearsal | None = None
        for sequence in SEQUENCES:
            result = rehearser.run(point, sequence)
            if best is None or result.best_visibility > best.best_visibility:
                best = result
            if best.best_visibility >= scene.thresholds.roi_visibility:
                break
        if best is not None:
            yield best


def find_exposing(scene: Scene) -> Rehearsal | None:
    """A rehearsal that exposes the region; None where no grasp point and sequence does."""
    for result in best_rehearsals(scene, grasp_points(scene)):
        if result.best_visibility >= scene.thresholds.roi_visibility:
            return result
    return None


def exposure_map(scene: Scene) -> Mapping[GraspPoint, Rehearsal]:
    """The best rehearsal of every grasp point."""
    points = grasp_points(scene)
    return dict(zip(points, best_rehearsals(scene, points), strict=True))
