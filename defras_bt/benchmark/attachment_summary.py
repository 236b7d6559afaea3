"""Tables of the benchmark of estimators: shares with intervals, medians, calibration."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from defras_bt.benchmark.attachment_cases import HIDDEN, OF_ATTACHMENTS
from defras_bt.benchmark.attachment_scores import NEAR_M
from defras_bt.benchmark.attachments import NOBODY, ORACLE
from defras_bt.benchmark.intervals import median, share
from defras_bt.benchmark.retraction import Row


def summed_up(rows: Sequence[Row], names: Sequence[str]) -> list[dict[str, Any]]:
    """One line per estimator, and one of the belief, over updates with other attachments."""
    lines = []
    for name in (NOBODY, *names, ORACLE):
        mine = _asked(rows, name, OF_ATTACHMENTS)
        if not mine:
            continue
        lines.append(
            {
                "estimator": name,
                "updates": len(mine),
                "adopted": share([bool(v["adopted"]) for v in mine]),
                "back, local": share([bool(v.get("under_local")) for v in mine]),
                "back, median": share([bool(v.get("under_median")) for v in mine]),
                "surface [mm]": median([v.get("surface_median_mm") for v in mine]),
                "surface, 95 % [mm]": median([v.get("surface_95_mm") for v in mine]),
                "force [%]": median([_percent(v.get("force_error")) for v in mine]),
                "F1": median([v["f1"] for v in mine]),
                "F1 of changes": median([v["changes_f1"] for v in mine]),
                **_near(mine),
                "calibration": round(_calibration_error(mine), 3),
                "wall [s]": median([v.get("wall_s") for v in mine]),
                "computing [s]": median([v.get("cpu_s") for v in mine]),
            }
        )
    return lines


def torn_down(rows: Sequence[Row], names: Sequence[str]) -> list[dict[str, Any]]:
    """Per estimator, how often something else was put down to attachments."""
    drawn = {row.relation for row in rows}
    others = [hidden for hidden in HIDDEN if hidden not in OF_ATTACHMENTS and hidden in drawn]
    lines = []
    for name in names:
        line: dict[str, Any] = {"estimator": name}
        for hidden in others:
            mine = _asked(rows, name, [hidden])
            line[hidden] = f"{sum(bool(v['adopted']) for v in mine)} of {len(mine)}"
        mine = _asked(rows, name, others)
        line["wrongly adopted"] = share([bool(v["adopted"]) for v in mine])
        lines.append(line)
    return lines


def run_rows(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """One line per update and estimator."""
    keys = sorted({key for row in rows for key in row.values} - {"bins"})
    return [
        {"case": row.case, "estimator": row.run, **{key: row.values.get(key) for key in keys}}
        for row in rows
    ]


def _asked(rows: Sequence[Row], name: str, hidden: Sequence[str]) -> list[Any]:
    return [
        row.values
        for row in rows
        if row.run == name and row.relation in hidden and row.values.get("asked")
    ]


def _percent(value: float | None) -> float | None:
    return None if value is None else 100 * value


def _near(values: Sequence[Any]) -> dict[str, str]:
    """Precision and recall over all updates, by distance from the grasp."""
    said = {}
    for number in range(len(NEAR_M) - 1):
        found, wanted, both = np.sum([v[f"near{number}"] for v in values], axis=0)
        low_mm, high_mm = (1e3 * limit for limit in NEAR_M[number : number + 2])
        said[f"precision / recall, {low_mm:.0f} to {high_mm:.0f} mm"] = (
            f"{both / max(found, 1):.2f} / {both / max(wanted, 1):.2f}"
        )
    return said


def _calibration_error(values: Sequence[Any]) -> float:
    """Expected calibration error over all holes of all updates."""
    count, said, holds = np.sum([v["bins"] for v in values], axis=0)
    return float(np.abs(said - holds).sum() / max(count.sum(), 1))
