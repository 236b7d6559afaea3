"""Table 1 in numbers: per tree the success count, then median, mean and worst of each measure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from defras_bt.benchmark.table1 import Row

MEASURES = {
    "visibility": "roi_visibility",
    "actions": "actions",
    "replans": "replans",
    "s over epsilon": "time_over_threshold_s",
    "F max estimated N": "force_max_n",
    "F max true N": "force_max_true_n",
}


def by_case(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """One line per run."""
    lines = []
    for row in sorted(rows, key=lambda r: (r.scene, r.relation, r.tree)):
        updates = row.values.get("attachment_updates", {"tried": 0, "adopted": 0})
        lines.append(
            {
                "case": f"{row.scene} {row.relation}",
                "tree": row.tree,
                "outcome": row.values["outcome"],
                **{name: row.values.get(key) for name, key in MEASURES.items()},
                "updates adopted": updates["adopted"],
                "updates tried": updates["tried"],
                "wall s": row.values.get("wall_s"),
            }
        )
    return lines


def by_tree(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Per tree: successes, then "median / mean / worst" of every measure.

    Medians alone hide the runs that hurt, so the worst always stands beside them.
    """
    lines = []
    for tree in dict.fromkeys(row.tree for row in rows):
        runs = [row.values for row in rows if row.tree == tree]
        reached = sum(run["outcome"] == "goal" for run in runs)
        line: dict[str, Any] = {
            "tree": tree,
            "goal reached": f"{reached} of {len(runs)}",
            "human asked": sum(run["outcome"] == "human" for run in runs),
        }
        for name, key in MEASURES.items():
            values = [float(run[key]) for run in runs if run.get(key) is not None]
            worst = min if key == "roi_visibility" else max
            line[name] = (
                f"{np.median(values):.2f} / {np.mean(values):.2f} / {worst(values):.2f}"
                if values
                else None
            )
        lines.append(line)
    return lines
