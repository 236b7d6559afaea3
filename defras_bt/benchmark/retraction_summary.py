"""Many retractions in numbers: success with its interval, then median, spread, mean and worst."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.stats import binomtest

from defras_bt.benchmark.retraction import Row

MEASURES = {
    "visibility": "roi_visibility",
    "actions": "actions",
    "replans": "replans",
    "s over epsilon": "time_over_threshold_s",
    "ticks over epsilon": "ticks_over_threshold",
    "s over epsilon, true force": "time_over_threshold_true_s",
    "F max estimated N": "force_max_n",
    "F max true N": "force_max_true_n",
    "F error before updates N": "force_error_before_n",
    "F error after updates N": "force_error_after_n",
    "wall s": "wall_s",
}


def by_case(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """One line per run."""
    lines = []
    for row in sorted(rows, key=lambda r: (r.case, r.relation, r.run)):
        updates = row.values.get("attachment_updates", {"tried": 0, "adopted": 0})
        lines.append(
            {
                "case": f"{row.case} {row.relation}",
                "tree": row.run,
                "outcome": row.values["outcome"],
                **{name: row.values.get(key) for name, key in MEASURES.items()},
                "updates adopted": updates["adopted"],
                "updates tried": updates["tried"],
                "why not": None if row.values["outcome"] == "goal" else _why(row),
            }
        )
    return lines


def _why(row: Row) -> str | None:
    """In words why the goal was not reached, where the run says so."""
    reason = row.values.get("reason") or {}
    return row.values.get("error") or reason.get("sentence")


def success(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Per tree and relation: runs that reached the goal, with Wilson's 95 % interval."""
    lines = []
    for run in dict.fromkeys(row.run for row in rows):
        for relation in (*dict.fromkeys(row.relation for row in rows), "all"):
            outcomes = [
                row.values["outcome"]
                for row in rows
                if row.run == run
                and relation in (row.relation, "all")
                and row.values["outcome"] != "no scene"
            ]
            if not outcomes:
                continue
            reached = outcomes.count("goal")
            interval = binomtest(reached, len(outcomes)).proportion_ci(0.95, "wilson")
            lines.append(
                {
                    "tree": run,
                    "attachments": relation,
                    "goal reached": f"{reached} of {len(outcomes)}",
                    "rate": round(reached / len(outcomes), 3),
                    "95 % interval": f"{interval.low:.2f} to {interval.high:.2f}",
                    "human asked": outcomes.count("human"),
                    "not reached": outcomes.count("not_reached"),
                    "errors": outcomes.count("error"),
                }
            )
    return lines


def spread(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Per tree and measure: median, quartiles, mean and worst.

    Medians alone hide the runs that hurt, so the worst always stands beside them.
    """
    lines = []
    for run in dict.fromkeys(row.run for row in rows):
        runs = [row.values for row in rows if row.run == run]
        for name, key in MEASURES.items():
            values = [float(one[key]) for one in runs if one.get(key) is not None]
            if not values:
                continue
            low, middle, high = np.percentile(values, [25, 50, 75])
            lines.append(
                {
                    "tree": run,
                    "measure": name,
                    "median": round(middle, 3),
                    "quartiles": f"{low:.3g} to {high:.3g}",
                    "mean": round(float(np.mean(values)), 3),
                    "worst": round(min(values) if key == "roi_visibility" else max(values), 3),
                }
            )
    return lines
