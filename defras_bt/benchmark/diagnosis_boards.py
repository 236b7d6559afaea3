"""Score boards of the diagnosis: from rows to what they say together."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.stats import beta

from defras_bt.benchmark.diagnosis_cases import CAUSES
from defras_bt.benchmark.diagnosis_runs import BoardRow
from defras_bt.diagnosis.baselines import BASELINES
from defras_sim.effects.effect import TwinName

TWINS: tuple[TwinName, ...] = ("arm", "coupon", "tissue")
_OTHER = ("set", "outside", "nothing")
_STRONG = 2.0
"""Times the detection limit."""


def boards(rows: Sequence[BoardRow]) -> dict[str, list[dict[str, Any]]]:
    """All boards by heading; those without a row are left out."""
    good = [row for row in rows if not row.error]
    found = {
        "Score": [_score(good, twin) for twin in TWINS if any(r.twin == twin for r in good)],
        "Beside the baselines": _beside(good),
        **{f"What was said of what was hidden: {twin}": confusion(good, twin) for twin in TWINS},
        "Failed": [{"case": row.key, "error": row.error} for row in rows if row.error],
        "Every case": [_case(row) for row in rows],
    }
    return {head: table for head, table in found.items() if table}


def _score(rows: Sequence[BoardRow], twin: TwinName) -> dict[str, Any]:
    own = [row for row in rows if row.twin == twin]
    one = [row for row in own if row.board == "one"]
    nothing = [row for row in own if row.board == "nothing"]
    lacking = [row for row in own if row.board == "lacking"]
    two = [row for row in own if row.board == "two"]
    covered = [held for row in one if is_right(row) for held in row.covered.values()]
    return {
        "twin": twin,
        "named right (macro)": _macro(one),
        "from twice the limit on (macro)": _macro([row for row in one if _is_strong(row)]),
        "right or in the set": _share([is_right(row) or _in_set(row) for row in one]),
        "false alarm": _share([row.verdict != "nothing" for row in nothing]),
        "lacking: outside": _share([row.verdict == "outside" for row in lacking]),
        "lacking: wrong name": _share([bool(row.named) for row in lacking]),
        "two: both named or a set": _share([is_right(row) or _in_set(row) for row in two]),
        "intervals that cover": _share(covered),
        **{
            f"removed, {what}": _median([getattr(row, key) for row in one if is_right(row)])
            for what, key in (
                ("in range", "in_range"),
                ("beyond", "beyond_range"),
                ("new grasp", "new_grasp"),
            )
        },
        "seconds, median / worst": _seconds(own),
    }


def confusion(rows: Sequence[BoardRow], twin: TwinName) -> list[dict[str, Any]]:
    """One row for each hidden cause: how often each name was given, never averaged."""
    own = [row for row in rows if row.twin == twin and row.board in ("one", "nothing")]
    names = sorted({name for row in own for name in row.named})
    table = []
    for cause in (*CAUSES[twin], "nothing"):
        hidden = [row for row in own if ("+".join(row.causes) or "nothing") == cause]
        if not hidden:
            continue
        line: dict[str, Any] = {"hidden": cause, "runs": len(hidden)}
        line |= {name: sum(name in row.named for row in hidden) or "" for name in names}
        line |= {f"({v})": sum(row.verdict == v for row in hidden) or "" for v in _OTHER}
        table.append(line)
    return table


def in_words(rows: Sequence[BoardRow], twin: TwinName) -> list[dict[str, Any]]:
    """The same as :func:`confusion` in words, for a narrow screen: what was said of each hidden
    cause, the most frequent first."""
    own = [row for row in rows if row.twin == twin and row.board in ("one", "nothing")]
    table = []
    for cause in (*CAUSES[twin], "nothing"):
        hidden = [row for row in own if ("+".join(row.causes) or "nothing") == cause]
        counted = Counter(_answer(row) for row in hidden)
        if hidden:
            answers = "; ".join(f"{words} {n}" for words, n in counted.most_common())
            table.append({"hidden": cause, "runs": len(hidden), "said": answers})
    return table


def _answer(row: BoardRow) -> str:
    if row.verdict == "set":
        return f"set of {', '.join(row.alike)}"
    return " + ".join(row.named) or row.verdict


def is_right(row: BoardRow) -> bool:
    """Whether just what was hidden was named, and nothing left open; at whichever site, where none
    is part of what was hidden."""
    return row.verdict == "named" and sorted(said_of(row, row.named)) == sorted(row.causes)


def _in_set(row: BoardRow) -> bool:
    """Whether the verdict leaves open a set that holds what was hidden."""
    return row.verdict == "set" and set(row.causes) <= set(said_of(row, (*row.named, *row.alike)))


def said_of(row: BoardRow, keys: Sequence[str]) -> list[str]:
    """``keys`` as what was hidden is called: without their site, where it has none."""
    return [key.split("@")[0] if key.split("@")[0] in row.causes else key for key in keys]


def _beside(rows: Sequence[BoardRow]) -> list[dict[str, Any]]:
    """The engine and each baseline on the same cases."""
    asked = [row for row in rows if row.baselines]
    if not asked:
        return []
    one = [row for row in asked if row.board == "one"]
    nothing = [row for row in asked if row.board == "nothing"]
    lacking = [row for row in asked if row.board == "lacking"]
    table: list[dict[str, Any]] = [
        {
            "approach": "this engine",
            "named right": _share([is_right(row) for row in one]),
            "false alarm": _share([row.verdict != "nothing" for row in nothing]),
            "wrong name where the cause is lacking": _share([bool(row.named) for row in lacking]),
        }
    ]
    for name in BASELINES:
        table.append(
            {
                "approach": name,
                "named right": _share([row.baselines[name][1] in row.causes for row in one]),
                "false alarm": _share([bool(row.baselines[name][0]) for row in nothing]),
                "wrong name where the cause is lacking": _share(
                    [row.baselines[name][1] is not None for row in lacking]
                ),
            }
        )
    return table


def _is_strong(row: BoardRow) -> bool:
    """Whether what was hidden is at least twice as strong as what can just be told from chance."""
    return row.times_limit is not None and row.times_limit >= _STRONG


def _macro(rows: Sequence[BoardRow]) -> str:
    """Mean over causes of the share named right, with the runs."""
    causes = sorted({row.causes[0] for row in rows})
    if not causes:
        return "-"
    shares = [np.mean([is_right(row) for row in rows if row.causes[0] == c]) for c in causes]
    return f"{np.mean(shares):.0%} of {len(rows)}"


def _share(marks: Sequence[bool]) -> str:
    """A share with its 95 % interval (Clopper and Pearson 1934) and the number of runs."""
    count, hits = len(marks), int(sum(marks))
    if not count:
        return "-"
    low = beta.ppf(0.025, hits, count - hits + 1) if hits else 0.0
    high = beta.ppf(0.975, hits + 1, count - hits) if hits < count else 1.0
    return f"{hits / count:.0%} ({low:.0%} to {high:.0%}) of {count}"


def _median(gains: Sequence[float | None]) -> str:
    known = [gain for gain in gains if gain is not None]
    if not known:
        return "-"
    return f"{np.median(known):.0%}, {np.mean(np.array(known) < 0):.0%} negative"


def _seconds(rows: Sequence[BoardRow]) -> str:
    spent = [row.wall_s for row in rows]
    return f"{np.median(spent):.0f} / {max(spent):.0f}"


def _case(row: BoardRow) -> dict[str, Any]:
    return {
        "case": row.key,
        "verdict": row.verdict,
        "named": ", ".join(row.named),
        "set": ", ".join(row.alike),
        "right": is_right(row),
        "times the limit": row.times_limit,
        "in range": row.in_range,
        "beyond range": row.beyond_range,
        "new grasp": row.new_grasp,
        "unexplained": row.unexplained,
        "seconds": row.wall_s,
        "error": row.error,
    }
