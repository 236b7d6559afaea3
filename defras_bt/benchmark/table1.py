"""The paper's simulated cases: every tree on every pair of believed and actual scene."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from joblib import Parallel, delayed

from defras_bt.executive.executive import ExecutiveFailed
from defras_bt.executive.operation import Operation, operate
from defras_bt.executive.tree_file import read_tree
from defras_bt.planning.engine import Engine
from defras_bt.planning.preparation import needs_plan, prepare
from defras_bt.recording.record import RunInfo, RunSummary, TickRecord
from defras_sim.resources import resource
from defras_sim.scene import load_scene

TREES = ("defras", "defras_paper", "fras")
BELIEVED = tuple(f"sim{number}" for number in range(1, 9))
RELATIONS = ("fewer", "more")


@dataclass(frozen=True)
class Row:
    """One run: believed scene, relation of the actual one, tree, and the content of run.json."""

    scene: str
    relation: str
    tree: str
    values: dict[str, Any]


def table1(world: str, trees: Sequence[str] = TREES, seed: int = 0, jobs: int = 2) -> Iterator[Row]:
    """Run all cases; rows come as believed scenes are finished.

    A run that breaks is a row with outcome "error", like any other that did not reach the goal.
    """
    work = (delayed(_runs_of)(scene, world, tuple(trees), seed) for scene in BELIEVED)
    for rows in Parallel(n_jobs=jobs, return_as="generator_unordered")(work):
        yield from rows


def _runs_of(scene: str, world: str, trees: tuple[str, ...], seed: int) -> list[Row]:
    believed_file = resource(f"sim/scenes/{scene}.yaml")
    believed = load_scene(believed_file)
    prepared = prepare(
        believed.for_bullet() if world == "bullet" else believed, engine=Engine(jobs=1)
    )
    rows = []
    for relation in RELATIONS:
        actual_file = resource(f"sim/scenes/{scene}_{relation}.yaml")
        for tree in trees:
            tree_file = resource(f"trees/{tree}.yaml")
            operation = Operation(
                scene=believed,
                actual=load_scene(actual_file),
                scene_file=believed_file.name,
                actual_file=actual_file.name,
                world=world,
                tree_file=tree_file,
                seed=seed,
                force_threshold_n=prepared.force_threshold_n,
                preoperative=prepared.plan if needs_plan(read_tree(tree_file)) else None,
            )
            rows.append(Row(scene, relation, tree, _values(operation)))
    return rows


def _values(operation: Operation) -> dict[str, Any]:
    kept = _KeepSummary()
    try:
        return dict(operate(operation, [kept]).values)
    except ExecutiveFailed as error:
        return {**kept.values, "error": str(error)}


class _KeepSummary:
    """Keeps the summary of a run that ends in an exception."""

    def __init__(self) -> None:
        self.values: dict[str, Any] = {}

    def start(self, info: RunInfo) -> None: ...

    def tick(self, record: TickRecord) -> None: ...

    def finish(self, summary: RunSummary) -> None:
        self.values = dict(summary.values)
