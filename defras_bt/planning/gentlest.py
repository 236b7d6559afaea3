"""The rehearsals that a choice needs, where the force threshold is known before.

The selection rule keeps the gentlest few of the retractions that expose the region. A retraction
that already pulls harder than the last of those cannot be chosen, whatever it would still show: it
is followed no further. The choice is the same as after all rehearsals (tested).
"""

from __future__ import annotations

from defras_bt.planning.choice import LOWEST_FORCES_KEPT, forbidden
from defras_bt.planning.execution import Execution
from defras_bt.planning.rehearsals import STEP_M, reachable_points
from defras_sim.exposure import promising_points
from defras_sim.retraction import SEQUENCES, Rehearser
from defras_sim.scene import Scene


def rehearse_gentlest(
    scene: Scene, limit_n: float, *, step_m: float = STEP_M
) -> tuple[Execution, ...]:
    """Every reachable grasp point with every sequence, each as far as it can still be chosen.

    For :func:`~defras_bt.planning.choice.choose` only: what was cut short shows no more than was
    seen by then. The order is that of :func:`~defras_bt.planning.rehearsals.rehearse_all`. Points
    that promise most come first on the way: the sooner gentle ones are known, the less is followed
    of the others.
    """
    rehearser = Rehearser(scene, step_m=step_m, stop_when_exposed=True)
    reachable = reachable_points(scene)
    found: dict[tuple[int, int], dict[tuple[str, ...], Execution]] = {p: {} for p in reachable}
    gentlest_n: list[float] = []
    for point in promising_points(scene):
        for sequence in SEQUENCES if point in found else ():
            full = len(gentlest_n) == LOWEST_FORCES_KEPT
            most_n = gentlest_n[-1] if full else limit_n
            execution = Execution.of(rehearser.run(point, sequence, most_force_n=most_n))
            new = execution.manoeuvres not in found[point]
            found[point][execution.manoeuvres] = execution
            if new and _counts(scene, execution, most_n):
                gentlest_n = sorted([*gentlest_n, execution.force_max_n])[:LOWEST_FORCES_KEPT]
    return tuple(e for point in reachable for e in found[point].values())


def _counts(scene: Scene, execution: Execution, limit_n: float) -> bool:
    return (
        execution.visibility >= scene.thresholds.roi_visibility
        and execution.force_max_n <= limit_n
        and not forbidden(scene, execution)
    )
