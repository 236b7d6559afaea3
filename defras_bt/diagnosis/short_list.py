"""Which candidates are worth a full fit, and against which others each has to stand."""

from __future__ import annotations

from collections.abc import Sequence

from defras_bt.diagnosis.diagnosis import Ranked
from defras_bt.diagnosis.excess import is_practical
from defras_bt.diagnosis.held_out import Products
from defras_bt.diagnosis.ranking import Board, alike, remainder, score
from defras_bt.diagnosis.search import Search

_NEARLY = 0.7
"""Of the practical floors."""
_HOPELESS = 0.5
"""Of the threshold: candidates below it on the linearised model are not fitted."""
_NOT_MUCH_WORSE = 0.3
"""Of the best rival's statistic: those below it are not fitted either."""
_RIVALS = 0.3
"""Cosine of what two candidates explain, from which on they are tried against each other."""
_IN_A_CONTEST, _CONTESTS = 3, 4


def worth_naming(
    search: Search, now: Board, found: Products, rows: tuple[Ranked, ...]
) -> tuple[Ranked, ...]:
    """Candidates whose change would be worth naming by the linearised model; where none is, those
    whose change is not far from it, as the linearised model may see too little of a cause.

    What is clearly seen but of no practical size must not stand in the way of what is both.
    """
    scores = score(now, found)
    residual = search.fit.residual
    worth, nearly = [], []
    for row in rows:
        if not row.visible:
            continue
        option = int(scores.option[row.key][0])
        without_it = remainder(now, found, residual, row.key, None)
        # The accepted causes make room for it, as they will when it is fitted: what they could do
        # as well is not its own.
        with_it = remainder(now, found, residual, row.key, option)
        change = without_it - with_it
        share = search.settings.relative_gain
        if is_practical(change, without_it, with_it, search.samples, share):
            worth.append(row)
        elif is_practical(change, without_it, with_it, search.samples, share, _NEARLY):
            nearly.append(row)
    return tuple(worth or nearly)


def hopeful(search: Search, rows: tuple[Ranked, ...], limit: float) -> list[Ranked]:
    """The candidates worth a full fit: proper ones first, nuisances where no other is. Where
    several are above chance, those of no promise by themselves wait for the next round."""
    enough = [row for row in rows if row.visible and row.held_out > _HOPELESS * limit]
    proper = [row for row in enough if not search.sketch.candidate(row.key).nuisance]
    chosen = proper if any(row.held_out > limit for row in proper) else enough
    above = [row for row in chosen if row.held_out > limit]
    return (above or chosen)[: search.settings.tried]


def nuisances(search: Search, rows: tuple[Ranked, ...], limit: float) -> list[Ranked]:
    """The nuisances that are worth a full fit."""
    return [
        row
        for row in rows
        if search.sketch.candidate(row.key).nuisance
        and row.visible
        and row.held_out > _HOPELESS * limit
    ]


def contests(now: Board, found: Products, rows: Sequence[Ranked]) -> list[tuple[str, ...]]:
    """Groups of candidates that explain much the same, the best of each first.

    Causes that have nothing to do with each other can be accepted in one round. Of a group, those
    far behind the best are left out.
    """
    groups: list[list[Ranked]] = []
    for row in rows:
        home = next((g for g in groups if alike(now, found, g[0].key, row.key) > _RIVALS), None)
        if home is None:
            groups.append([row])
        elif row.held_out > _NOT_MUCH_WORSE * home[0].held_out and len(home) < _IN_A_CONTEST:
            home.append(row)
    return [tuple(row.key for row in group) for group in groups[:_CONTESTS]]


def with_best_fitting(
    search: Search, groups: Sequence[tuple[str, ...]], worth: Sequence[Ranked], limit: float
) -> list[tuple[str, ...]]:
    """``groups``, of which the first has also to stand against the candidate that fits best.

    What happens once, as a slip, is seen in one fold; of the others its linearised shape may
    foretell little where the true one foretells nearly all.
    """
    proper = [row for row in worth if not search.sketch.candidate(row.key).nuisance]
    best = max(proper, key=lambda row: row.gain, default=None)
    if best is None or best.gain <= limit or any(best.key in group for group in groups):
        return list(groups)
    first, *others = groups or [()]
    return [(*first, best.key), *others]
