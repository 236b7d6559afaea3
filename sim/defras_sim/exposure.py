"""Which grasp points expose the region, if the scene's attachments are the true ones."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from defras_sim.retraction import SEQUENCES, Rehearsal, Rehearser
from defras_sim.scene import GraspPoint, Scene

# A coarse mesh and long steps find the promising retractions in a third of the time.
SCREENING_ELEMENTS_XYZ = (6, 6, 1)
SCREENING_STEP_M = 0.005

_FAR_M = 1.0
"""As far as attachments are where there are none."""

# To count as exposing, a retraction shows this much more than the goal, so that another mesh or a
# slightly different motion still reaches it.
VISIBILITY_MARGIN = 0.05

# The force limit of the DEFRAS paper, for scenes that state none.
PAPER_FORCE_N = 0.3


def promising_points(scene: Scene) -> list[GraspPoint]:
    """All grasp points, the most promising first: far from attachments, close to the region."""
    held_xy_m = scene.holes_xy_m[scene.attached]

    def promise_m(point: GraspPoint) -> float:
        xy_m = scene.grasp_xy_m(*point)
        from_held = np.linalg.norm(held_xy_m - xy_m, axis=1).min(initial=_FAR_M)
        from_region = np.linalg.norm(scene.roi_center_m[:2] - xy_m)
        return float(np.round(from_held - from_region, 9))

    return sorted(scene.grasp_points, key=lambda point: (-promise_m(point), point))


def best_rehearsals(
    scene: Scene, points: Sequence[GraspPoint], most_force_n: float = np.inf
) -> Iterator[Rehearsal]:
    """For each point the rehearsal that shows most of the region, over :data:`SEQUENCES`.

    A point is done as soon as one sequence exposes the region. Sequences are followed up to
    ``most_force_n``: of tissue that is held firmly, most need not be gone through.
    """
    rehearser = Rehearser(scene, step_m=SCREENING_STEP_M, stop_when_exposed=True)
    for point in points:
        best = rehearser.run(point, SEQUENCES[0], most_force_n=most_force_n)
        for sequence in SEQUENCES[1:]:
            if best.best_visibility >= scene.thresholds.roi_visibility:
                break
            result = rehearser.run(point, sequence, most_force_n=most_force_n)
            if result.best_visibility > best.best_visibility:
                best = result
        yield best


def find_exposing(scene: Scene, most_points: int = 10) -> Rehearsal | None:
    """A gentle retraction that exposes the region, from one of the most promising points.

    Gentle: never above ``thresholds.force_n``, or 0.3 N where the scene states none. Screened on a
    coarse mesh, confirmed on the finer one on which ``scene`` would be simulated.
    """
    limits = scene.thresholds
    force_n = PAPER_FORCE_N if limits.force_n is None else limits.force_n
    wanted = min(1.0, limits.roi_visibility + VISIBILITY_MARGIN)
    stricter = scene.model_copy(
        update={"thresholds": limits.model_copy(update={"roi_visibility": wanted})}
    )
    reality = on_mesh(stricter, scene.simulation.elements_xyz)
    coarse = on_mesh(stricter, SCREENING_ELEMENTS_XYZ)
    for found in best_rehearsals(coarse, promising_points(scene)[:most_points], force_n):
        if found.best_visibility >= wanted and found.force_max_n <= force_n:
            rehearser = Rehearser(reality, step_m=SCREENING_STEP_M, stop_when_exposed=True)
            confirmed = rehearser.run(found.point, found.manoeuvres)
            if confirmed.best_visibility >= wanted and confirmed.force_max_n <= force_n:
                return confirmed
    return None


def on_mesh(scene: Scene, elements_xyz: tuple[int, int, int]) -> Scene:
    """The scene with another mesh, unless it uses linear tetrahedra, which need theirs."""
    if scene.tissue.element == "tetrahedron4":
        return scene
    tissue = scene.tissue.model_copy(update={"elements_xyz": elements_xyz})
    return scene.model_copy(update={"tissue": tissue})
