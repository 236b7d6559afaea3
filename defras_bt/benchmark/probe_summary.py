"""Tables of the benchmark of tugs: how often there is one, and whether it pays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from defras_bt.benchmark.attachment_cases import OF_ATTACHMENTS
from defras_bt.benchmark.intervals import LEAST_PAIRS, Difference, share
from defras_bt.benchmark.probe import ARMS, BEFORE, GOES_ON, SURE, TUG
from defras_bt.benchmark.retraction import Row


@dataclass(frozen=True)
class Measure:
    """``key`` of the rows' values; ``better`` is 1 where more is better, -1 where less is."""

    title: str
    key: str
    better: int


F1 = Measure("F1", "f1", 1)
"""What decides whether a tug pays."""

MEASURES = (
    F1,
    Measure("F1 of changes", "changes_f1", 1),
    Measure("doubtful holes that are right", "doubtful_right", 1),
    Measure("Brier score", "brier", -1),
    Measure("back, local", "under_local", 1),
    Measure("surface [mm]", "surface_median_mm", -1),
    Measure("surface at the end of the plan [mm]", "ahead_surface_median_mm", -1),
    Measure("largest true force [N]", "force_most_n", -1),
    Measure("largest true force [of the threshold]", "force_share", -1),
    Measure("over the threshold", "over", -1),
    Measure("computing [s]", "cpu_s", -1),
)


def frequencies(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """How often learning leaves doubt, and how often there is a safe tug then."""
    lines = []
    for name, hidden in (*((each, (each,)) for each in OF_ATTACHMENTS), ("all", OF_ATTACHMENTS)):
        seeds = [row.values for row in rows if row.run == BEFORE and row.relation in hidden]
        asked = [values for values in seeds if values.get("asked")]
        doubted = [values for values in asked if values["found"] != SURE]
        lines.append(
            {
                "attachments": name,
                "seeds": len(seeds),
                "errors": sum("error" in values for values in seeds),
                "updates": len(asked),
                "adopted": share([bool(values["adopted"]) for values in asked]),
                "left in doubt": share([values["found"] != SURE for values in asked]),
                "safe tug": share([values["found"] == TUG for values in asked]),
                "safe tug where in doubt": share([values["found"] == TUG for values in doubted]),
            }
        )
    return lines


def compared(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """One line per measure, over cases with a tug: means, medians, and paired differences."""
    lines = []
    for measure in MEASURES:
        values = _values(rows, measure)
        difference = _difference(rows, measure)
        line: dict[str, Any] = {"measure": measure.title, "cases": difference.pairs}
        for statistic, told in ((np.mean, "mean"), (np.median, "median")):
            for arm in ARMS:
                known = [each[arm] for each in values if arm in each]
                line[f"{arm}, {told}"] = round(float(statistic(known)), 3) if known else None
        line[f"{TUG} minus {GOES_ON}"] = str(difference)
        line["better"] = {1: TUG, 0: "-", -1: GOES_ON}[measure.better * difference.sign]
        lines.append(line)
    return lines


def verdict(rows: Sequence[Row]) -> str:
    """Whether a tug pays, in one sentence: whether F1 is surely higher after it."""
    difference = _difference(rows, F1)
    if difference.pairs < LEAST_PAIRS:
        return (
            f"Whether a tug pays stays open: {difference.pairs} cases can be compared, "
            f"{LEAST_PAIRS} is the least."
        )
    pays = {
        1: "A tug pays",
        0: "A tug does not pay as far as these cases tell",
        -1: "A tug does not pay",
    }[difference.sign]
    return (
        f"{pays}: F1 of the attachments differs by {difference} from that after as much planned "
        f"motion, mean and 95 % interval over {difference.pairs} cases, of which "
        f"{difference.differing} differ."
    )


def run_rows(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """One line per case and arm."""
    keys = sorted({key for row in rows for key in row.values} - {"bins"})
    return [
        {"case": row.case, "arm": row.run, **{key: row.values.get(key) for key in keys}}
        for row in rows
    ]


def _values(rows: Sequence[Row], measure: Measure) -> list[dict[str, float]]:
    """Values by arm of each case in which they are known after a tug and after going on."""
    cases: dict[str, dict[str, float]] = {}
    for row in rows:
        value = row.values.get(measure.key)
        if value is not None:
            cases.setdefault(row.case, {})[row.run] = float(value)
    return [case for case in cases.values() if TUG in case and GOES_ON in case]


def _difference(rows: Sequence[Row], measure: Measure) -> Difference:
    return Difference.of([case[TUG] - case[GOES_ON] for case in _values(rows, measure)])
