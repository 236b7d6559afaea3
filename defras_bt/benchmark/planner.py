"""How long planning takes: one live clingo control against a fresh one for every plan."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defras_bt.planning.plan import ArmSituation, GridPoint, Plan, Situation
from defras_bt.planning.planner import NoPlan, Planner
from defras_sim.scene import Scene

GRIDS = (5, 10, 20, 40)
_EXPOSING = (("pull",), ("pull", "fold"), ("pull", "move"), ("pull", "move", "fold"))


@dataclass(frozen=True)
class Question:
    """What is asked: a situation and the believed attachments (holes,)."""

    situation: Situation
    attached: NDArray[np.bool_]


@dataclass(frozen=True)
class Timing:
    """``asked``: what changed since the last plan; times (plans,) in s of computing."""

    grid: int
    asked: str
    warm_s: tuple[float, ...]
    fresh_s: tuple[float, ...]

    def row(self) -> dict[str, Any]:
        warm, fresh = 1e3 * np.array(self.warm_s), 1e3 * np.array(self.fresh_s)
        return {
            "grasp points": f"{self.grid} x {self.grid}",
            "changed": self.asked,
            "plans": len(warm),
            "warm median ms": round(float(np.median(warm)), 2),
            "warm 99th ms": round(float(np.percentile(warm, 99)), 2),
            "fresh median ms": round(float(np.median(fresh)), 2),
            "fresh / warm": round(float(np.median(fresh) / np.median(warm)), 1),
        }


def questions(
    scene: Scene, rng: np.random.Generator, count: int, *, new_belief: bool
) -> Iterator[Question]:
    """Random situations; with ``new_belief`` three holes change from one to the next."""
    attached = scene.attached
    for _ in range(count):
        if new_belief:
            attached = attached.copy()
            attached[rng.integers(len(attached), size=3)] ^= True
        yield Question(_situation(scene, rng), attached)


def _situation(scene: Scene, rng: np.random.Generator) -> Situation:
    """Each arm idle, at a point, or holding one in some state of its retraction."""
    taken: set[GridPoint] = set()
    arms: dict[str, ArmSituation] = {}
    for name in scene.arms:
        own = [p for p in scene.grasp_points if name in scene.arms_at(*p) and p not in taken]
        point = own[rng.integers(len(own))]
        taken.add(point)
        done = ((), *_EXPOSING)[rng.integers(5)]
        arms[name] = (
            ArmSituation(jaw_open=bool(rng.integers(2))),
            ArmSituation(at=point, jaw_open=bool(rng.integers(2))),
            ArmSituation(at=point, holding=point, done=done),
        )[rng.integers(3)]
    share = rng.choice([0.0, 0.3, 0.8])
    free = rng.random(len(scene.grasp_points)) >= share
    blocked = frozenset(p for p, ok in zip(scene.grasp_points, free, strict=True) if not ok)
    return Situation(arms, blocked, _EXPOSING[rng.integers(len(_EXPOSING))])


def planning_times(
    scene: Scene,
    seed: int,
    grids: Sequence[int] = GRIDS,
    count: int = 100,
    clock: Callable[[], float] = time.process_time,
) -> Iterator[Timing]:
    """Times of ``count`` plans a grid (fewer on large ones); both ways give the same plans.

    ``clock`` counts seconds of this process's computing, so that a busy machine disturbs less.

    Raises:
        RuntimeError: the live control and a fresh one disagree on a plan.
    """
    for grid in grids:
        points = scene.grasp.model_copy(update={"columns": grid, "rows": grid})
        wide = scene.model_copy(update={"grasp": points})
        fewer = max(10, round(count * min(1.0, 100 / grid**2)))
        live = Planner(wide)
        for asked, new_belief in (("situation", False), ("situation and belief", True)):
            rng = np.random.default_rng([seed, grid, int(new_belief)])
            warm, fresh = [], []
            for question in questions(wide, rng, fewer, new_belief=new_belief):
                start = clock()
                now = _answer(live, question)
                between = clock()
                new = _answer(Planner(wide), question)
                warm.append(between - start)
                fresh.append(clock() - between)
                if now != new:
                    raise RuntimeError(f"live and fresh planner disagree: {now} and {new}")
            yield Timing(grid, asked, tuple(warm), tuple(fresh))


def _answer(planner: Planner, question: Question) -> Plan | None:
    try:
        plan = planner.plan(question.situation, question.attached)
    except NoPlan:
        return None
    return replace(plan, reasons=())
