"""Retractions of many patients with every tree, and by an oracle that knows the attachments."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed

from defras_bt.benchmark.cases import Case
from defras_bt.benchmark.force_error import ForceError
from defras_bt.benchmark.generated_scenes import GeneratedScenes
from defras_bt.benchmark.preparations import Plans, Preparations, in_world
from defras_bt.executive.executive import ExecutiveFailed
from defras_bt.executive.operation import Operation, operate
from defras_bt.executive.tree_file import read_tree
from defras_bt.planning.preparation import needs_plan
from defras_sim.resources import resource
from defras_sim.scene import Scene
from defras_sim.scene_generator import NoScene

TREES = ("defras", "defras_paper", "fras")
ORACLE = "oracle"
"""trees/defras.yaml with the actual attachments as its belief: what could be had at best."""

ROBUST = "robust"
"""trees/defras.yaml with a plan that was chosen over sampled sets of attachments."""

SAMPLES = 8
"""Sets of attachments around the belief for :data:`ROBUST`."""

RUNS = (*TREES, ORACLE)
ALL_RUNS = (*RUNS, ROBUST)


@dataclass(frozen=True)
class Row:
    """One run: the case, the tree or the oracle, and the content of run.json with more numbers.

    A run that broke is a row with outcome "error"; a seed without a scene is one with "no scene".
    """

    case: str
    relation: str
    run: str
    values: Mapping[str, Any]

    @property
    def key(self) -> str:
        return f"{self.case} {self.relation} {self.run}"


def run_cases(
    cases: Sequence[Case],
    runs: Sequence[str],
    world: str,
    preparations: Preparations,
    *,
    seed: int = 0,
    jobs: int = 2,
    done: frozenset[str] = frozenset(),
    scenes: Path | None = None,
) -> Iterator[Row]:
    """Run every case with every one of ``runs``, except those in ``done`` (see :attr:`Row.key`).

    ``scenes``: folder in which generated patients are kept.
    """
    missing = [
        (case, tuple(run for run in runs if f"{case.name} {case.relation} {run}" not in done))
        for case in cases
    ]
    work = (
        delayed(_rows_of)(together, world, preparations, seed, scenes)
        for together in _by_patient([(case, wanted) for case, wanted in missing if wanted])
    )
    for rows in Parallel(n_jobs=jobs, return_as="generator_unordered")(work):
        yield from rows


Wanted = tuple[Case, tuple[str, ...]]
"""A case, and the runs of it that are still missing."""


def _by_patient(missing: Sequence[Wanted]) -> list[list[Wanted]]:
    """Cases of one generated patient together: what is believed is then looked for once."""
    together: dict[object, list[Wanted]] = {}
    for number, (case, wanted) in enumerate(missing):
        key = ("shipped", number) if case.seed is None else ("seed", case.seed)
        together.setdefault(key, []).append((case, wanted))
    return list(together.values())


def _rows_of(
    together: Sequence[Wanted],
    world: str,
    preparations: Preparations,
    seed: int,
    scenes: Path | None,
) -> list[Row]:
    generated, plans = GeneratedScenes(scenes), Plans(preparations)
    return [
        row
        for case, runs in together
        for row in _rows_of_case(case, runs, world, plans, seed, generated)
    ]


def _rows_of_case(
    case: Case,
    runs: Sequence[str],
    world: str,
    plans: Plans,
    seed: int,
    generated: GeneratedScenes,
) -> list[Row]:
    try:
        believed, actual = case.scenes(generated)
    except NoScene as error:
        nothing = {"outcome": "no scene", "error": str(error)}
        return [Row(case.name, case.relation, run, nothing) for run in runs]
    # Every case meets its own noise; the same for all trees.
    digest = hashlib.sha256(f"{seed} {case.name} {case.relation}".encode()).digest()
    own_seed = seed if case.seed is None else int.from_bytes(digest[:4], "little")
    rows = []
    for run in runs:
        known = actual if run == ORACLE else believed
        values = _run(known, actual, run, world, plans, own_seed)
        rows.append(Row(case.name, case.relation, run, values))
    return rows


def _run(
    believed: Scene, actual: Scene, run: str, world: str, plans: Plans, seed: int
) -> dict[str, Any]:
    tree_file = resource(f"trees/{run if run in TREES else TREES[0]}.yaml")
    threshold_n = plans.threshold_n(believed)
    plan = None
    if needs_plan(read_tree(tree_file)):
        samples = SAMPLES if run == ROBUST else 0
        plan = plans.plan(in_world(believed, world), samples, seed)
    operation = Operation(
        scene=believed,
        actual=actual,
        scene_file=f"{believed.name}.yaml",
        actual_file=f"{actual.name}.yaml",
        world=world,
        tree_file=tree_file,
        seed=seed,
        force_threshold_n=threshold_n,
        preoperative=plan,
    )
    force = ForceError()
    try:
        values = dict(operate(operation, [force]).values)
    except ExecutiveFailed as error:
        values = {**force.summary, "outcome": "error", "error": str(error)}
    return {**values, **force.values()}
