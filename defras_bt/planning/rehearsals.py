"""Every retraction of a set of scenes, rehearsed in simulation, side by side and resumable."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

from joblib import Parallel, delayed

from defras_bt.planning.engine import Engine
from defras_bt.planning.execution import Execution
from defras_bt.planning.journal import Journal, search_key
from defras_bt.planning.plan import GridPoint
from defras_sim.retraction import SEQUENCES, Rehearser
from defras_sim.scene import Scene

Progress = Callable[[int, int], None]
"""Called with (grasp points rehearsed, of how many)."""

STEP_M = 0.004


def rehearse_all(
    scenes: Sequence[Scene],
    *,
    engine: Engine | None = None,
    journal: Journal | None = None,
    progress: Progress | None = None,
    step_m: float = STEP_M,
    only: Sequence[Collection[GridPoint]] | None = None,
) -> list[tuple[Execution, ...]]:
    """For each scene every reachable grasp point with every sequence of manoeuvres.

    ``only``: for each scene the points that matter, if not all do.

    The order is fixed, whatever runs side by side. A sequence that exposes the region before its
    last manoeuvre equals a shorter one and is listed once. Points in ``journal`` are not rehearsed
    again; the others are added to it as soon as they are done.
    """
    engine = engine or Engine()
    keys = [search_key(scene, step_m) for scene in scenes]
    points = [reachable_points(scene) for scene in scenes]
    if only is not None:
        points = [tuple(p for p in of if p in some) for of, some in zip(points, only, strict=True)]
    wanted = [(i, point) for i, of_scene in enumerate(points) for point in of_scene]
    found: dict[tuple[int, GridPoint], tuple[Execution, ...]] = {}
    for i, point in wanted:
        known = journal.known(keys[i], point) if journal is not None else None
        if known is not None:
            found[i, point] = known
    missing = [task for task in wanted if task not in found]
    if progress is not None:
        progress(len(found), len(wanted))
    if missing:
        with engine.running() as jobs:
            work = (delayed(_rehearse_point)(scenes[i], i, point, step_m) for i, point in missing)
            results = Parallel(n_jobs=jobs, return_as="generator_unordered")(work)
            for i, point, executions in results:
                found[i, point] = executions
                if journal is not None:
                    journal.add(keys[i], point, executions)
                if progress is not None:
                    progress(len(found), len(wanted))
    return [
        tuple(e for point in of_scene for e in found[i, point]) for i, of_scene in enumerate(points)
    ]


def reachable_points(scene: Scene) -> tuple[GridPoint, ...]:
    """Grasp points on some arm's side, row by row."""
    return tuple(point for point in scene.grasp_points if scene.arms_at(*point))


def _rehearse_point(
    scene: Scene, number: int, point: GridPoint, step_m: float
) -> tuple[int, GridPoint, tuple[Execution, ...]]:
    rehearser = Rehearser(scene, step_m=step_m, stop_when_exposed=True)
    found: dict[tuple[str, ...], Execution] = {}
    for sequence in SEQUENCES:
        rehearsal = rehearser.run(point, sequence)
        found[rehearsal.manoeuvres] = Execution.of(rehearsal)
    return number, point, tuple(found.values())
