"""Random tool paths through random tissue: does the model always say something true?

Nobody chose these paths to be solvable. They pull, push, fold and turn tissue that is attached
anywhere, up to forces at which no surgeon would go on.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass

import joblib
import numpy as np
from scipy.spatial.transform import Rotation

from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Attachments, MaterialName, Roi, Scene, Tissue
from defras_sim.tissue.grasp import NothingToGrasp
from defras_sim.tissue.model import TissueModel
from defras_sim.tissue.state import TissueState

MATERIALS: tuple[MaterialName, ...] = ("neo_hookean", "corotational")
STEP_M = 0.002
LARGEST_TURN_RAD = np.pi / 2
HOLES = 12  # along each side


@dataclass(frozen=True)
class PathResult:
    """What became of one path.

    ``stale`` steps did not converge and said so; ``untrue`` ones held a number that is not finite.
    ``error`` is what was raised, if anything. Iterations and ``slowest_s`` are those of the worst
    step, a wall-clock time.
    """

    path: int
    material: str
    attached: int
    steps: int
    stale: int
    untrue: int
    iterations: int
    slowest_s: float
    force_n: float
    error: str | None


@dataclass(frozen=True)
class PathsSummary:
    """All paths together; ``converged`` is the share of steps."""

    paths: int
    steps: int
    converged: float
    stale: int
    untrue: int
    errors: int
    slowest_s: float


def run_paths(
    count: int = 2000,
    seed: int = 0,
    jobs: int = 1,
    *,
    elements_xyz: tuple[int, int, int] | None = None,
    steps: int = 40,
    told: Callable[[PathResult], None] = lambda _: None,
) -> list[PathResult]:
    """Go ``count`` random paths of ``steps`` steps of 2 mm; path i depends on ``seed`` and i only.

    ``told`` hears of each path as it ends, in order.
    """
    work = joblib.Parallel(n_jobs=jobs, return_as="generator")(
        joblib.delayed(run_path)(seed, path, elements_xyz, steps) for path in range(count)
    )
    results = []
    for result in work:
        told(result)
        results.append(result)
    return results


def summary(results: Sequence[PathResult]) -> PathsSummary:
    steps = sum(result.steps for result in results)
    stale = sum(result.stale for result in results)
    return PathsSummary(
        paths=len(results),
        steps=steps,
        converged=1 - stale / steps if steps else 1.0,
        stale=stale,
        untrue=sum(result.untrue for result in results),
        errors=sum(result.error is not None for result in results),
        slowest_s=max((result.slowest_s for result in results), default=0.0),
    )


def failures(results: Sequence[PathResult]) -> list[dict[str, object]]:
    """One row for each path with steps that did not converge, or worse."""
    return [asdict(r) for r in results if r.stale or r.untrue or r.error is not None]


def run_path(
    seed: int, path: int, elements_xyz: tuple[int, int, int] | None, steps: int
) -> PathResult:
    """Grasp somewhere, follow a random path, let go."""
    rng = np.random.default_rng([seed, path])
    material = MATERIALS[path % len(MATERIALS)]
    scene = random_scene(rng)
    done = stale = untrue = iterations = 0
    slowest_s = force_n = 0.0
    error = None
    try:
        model = TissueModel(scene, elements_xyz=elements_xyz, material=material)
        tip = Pose(np.array([*rng.uniform(-0.055, 0.055, 2), 0.0]))
        model.grasp("psm1", tip)
        for goal in _random_way(rng, tip, steps):
            start = time.perf_counter()
            state = model.solve({"psm1": goal})
            slowest_s = max(slowest_s, time.perf_counter() - start)
            done += 1
            stale += not state.converged
            untrue += not _is_finite(state)
            iterations = max(iterations, state.iterations)
            force_n = max(force_n, float(np.linalg.norm(state.grasp_forces_n["psm1"])))
        model.release("psm1")
        untrue += not _is_finite(model.solve({}))
    except (ValueError, ArithmeticError, RuntimeError, NothingToGrasp) as fault:
        error = f"{type(fault).__name__}: {fault}"
    attached = int(np.sum(scene.attached))
    return PathResult(
        path, material, attached, done, stale, untrue, iterations, slowest_s, force_n, error
    )


def random_scene(rng: np.random.Generator) -> Scene:
    """A slab on its bed, attached in one to four clusters of random place and size."""
    x, y = np.meshgrid(np.arange(HOLES), np.arange(HOLES))
    held = np.zeros((HOLES, HOLES), dtype=bool)
    for _ in range(rng.integers(1, 5)):
        column, row = rng.uniform(-1, HOLES, 2)
        wide, high = rng.uniform(1, 5, 2)
        held |= ((x - column) / wide) ** 2 + ((y - row) / high) ** 2 <= 1
    held[tuple(rng.integers(0, HOLES, 2))] = True
    lines = tuple("".join(".#"[hole] for hole in line) for line in held.astype(int))
    return Scene(
        name="random",
        attachments=Attachments(map=lines),
        roi=Roi(center_x_m=0.0, center_y_m=0.0),
        tissue=Tissue(bed=True),
    )


def _random_way(rng: np.random.Generator, tip: Pose, steps: int) -> Iterator[Pose]:
    """``steps`` poses 2 mm apart, turning on the way, through points up to 60 mm off the grasp."""
    grasp_m, grasp_turn = tip.position_m, tip.rotation
    here_m, turn = grasp_m, np.zeros(3)
    goal_m, goal_turn = grasp_m + [0.0, 0.0, rng.uniform(0.01, 0.06)], turn
    for _ in range(steps):
        way_m = goal_m - here_m
        left_m = float(np.linalg.norm(way_m))
        share = min(1.0, STEP_M / left_m)
        here_m, turn = here_m + share * way_m, turn + share * (goal_turn - turn)
        yield Pose(here_m, Rotation.from_rotvec(turn).as_matrix() @ grasp_turn)
        if left_m <= STEP_M:
            goal_m, goal_turn = _random_goal(rng, grasp_m, here_m)


def _random_goal(
    rng: np.random.Generator, grasp_m: Floats, here_m: Floats
) -> tuple[Floats, Floats]:
    """A place within 60 mm of the grasp and above the tissue's rest, and a turn."""
    goal_m = here_m
    while np.linalg.norm(goal_m - here_m) < STEP_M:
        away = rng.normal(size=3)
        away *= 0.06 * rng.uniform() ** (1 / 3) / np.linalg.norm(away)
        away[2] = np.abs(away[2])
        goal_m = grasp_m + away
    axis = rng.normal(size=3)
    return goal_m, rng.uniform(0, LARGEST_TURN_RAD) * axis / np.linalg.norm(axis)


def _is_finite(state: TissueState) -> bool:
    numbers: list[Floats | float] = [state.nodes_m, state.attachment_forces_n]
    numbers += [*state.grasp_forces_n.values(), *state.grasp_moments_nm.values()]
    numbers += [state.strain_energy_j, state.largest_principal_stress_pa]
    return all(bool(np.all(np.isfinite(number))) for number in numbers)
