"""What each estimator makes of the same updates: does the twin follow again, and is it right."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from time import perf_counter, process_time

import numpy as np
from joblib import Parallel, delayed

from defras_bt.benchmark.attachment_cases import Hidden, draw_update
from defras_bt.benchmark.attachment_runs import asked_update
from defras_bt.benchmark.attachment_scores import scored
from defras_bt.benchmark.retraction import Row
from defras_bt.learning.chain.estimators import EstimatorName, estimator
from defras_bt.learning.estimate import AttachmentEstimate
from defras_sim.worlds.error import WorldError

NOBODY = "belief"
"""The row that says how things stand before any update."""

ORACLE = "actual"
"""The row of the actual attachments on the twin's mesh: what could be had at best."""


def run_updates(
    cases: Sequence[tuple[Hidden, int]],
    names: Sequence[EstimatorName],
    world: str,
    *,
    jobs: int,
    done: frozenset[str] = frozenset(),
) -> Iterator[Row]:
    """Every case once, with every estimator on the same keyframes, except those in ``done``."""
    work = [
        delayed(_rows)(hidden, seed, tuple(names), world)
        for hidden, seed in cases
        if f"{hidden} {seed} {hidden} {NOBODY}" not in done
    ]
    for rows in Parallel(n_jobs=jobs, return_as="generator_unordered")(work):
        yield from rows


def _rows(hidden: Hidden, seed: int, names: tuple[EstimatorName, ...], world: str) -> list[Row]:
    """Rows of the estimators, and at last that of the belief, which says that all are there."""
    case = draw_update(hidden, seed)
    nothing = {"asked": False}
    try:
        asked = asked_update(case, world)
    except WorldError as error:
        return [Row(case.name, hidden, NOBODY, {**nothing, "error": str(error)})]
    if asked is None:
        return [Row(case.name, hidden, NOBODY, nothing)]
    rows = []
    for name in names:
        made = estimator(name)
        before, cpu = perf_counter(), process_time()
        estimate = made.estimate(asked.belief, asked.keyframes, np.random.default_rng(seed))
        spent = {"wall_s": perf_counter() - before, "cpu_s": process_time() - cpu}
        values = {**scored(case, asked, estimate), **spent, "reason": estimate.reason}
        rows.append(Row(case.name, hidden, name, values))
    for run, attached in ((ORACLE, case.actual.attached), (NOBODY, asked.belief.attached)):
        known = AttachmentEstimate(attached, attached.astype(float), np.nan, np.nan, False, "")
        rows.append(Row(case.name, hidden, run, scored(case, asked, known)))
    return rows
