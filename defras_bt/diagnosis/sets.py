"""Which other causes explain the same: those that could be true and still look this much worse.

For every rival, data are made as it would make them (its fitted prediction, surrogate noise, and
what the twin itself may be off by), and both are fitted again. If the accepted cause is as far
ahead on the measured data as it hardly ever is on those, the rival is rejected (Cox 1962, by
simulation: Williams 1970).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from defras_bt.diagnosis.confounding import Confounding
from defras_bt.diagnosis.fitted import Fit, conflicts
from defras_bt.diagnosis.fitting import Addition, extend, refine, without
from defras_bt.diagnosis.held_out import losses, products
from defras_bt.diagnosis.ranking import board, score, start_of, whitened_products
from defras_bt.diagnosis.search import Progress, Search
from defras_bt.diagnosis.surrogates import surrogates
from defras_sim.geometry import Floats

_ALIKE = 0.8
_MOST = 3
_OFTEN = 0.2
"""Of repetitions of the same measurement."""
_BEHIND = 0.3
"""Of the named cause's statistic: rivals below it on the linearised model are not fitted."""


def rivals(search: Search, key: str, confounding: Confounding, told: Progress) -> dict[str, Fit]:
    """Candidates that cannot be told from the accepted cause ``key`` with this data, with the
    models in which they take its place."""
    found = {}
    for rival, fit in _rival_fits(search, key, confounding, told).items():
        # Each is judged with what is known of the accepted model, whoever was asked before.
        search.stand()
        then = search.fits[key][key] if _stood_together(search, key, rival) else None
        # When both were tried, the twin was equally accurate for both.
        if then is not None and _rejected(search, key, rival, then, fit):
            continue
        nearer = _approached(search, fit)
        if not _rejected(search, key, rival, search.fit, nearer):
            found[rival] = nearer
    # Whatever is asked next is asked of the accepted model.
    search.stand()
    return found


def simpler(search: Search, key: str, found: Mapping[str, Fit]) -> str | None:
    """Of the rivals ``found`` of an accepted cause, one that is a special case of it and from whose
    data as much would often speak for the cause; None where there is none.

    A special case with which that is rare, but not rare enough to reject it, stays a rival.
    """
    special = search.sketch.candidate(key).effect.special_cases
    return next(
        (
            rival
            for rival, fit in found.items()
            if search.sketch.candidate(rival).effect.name in special
            and _chance(search, key, rival, search.fit, fit) >= _OFTEN
        ),
        None,
    )


def _stood_together(search: Search, key: str, rival: str) -> bool:
    """Whether both were fitted beside the causes of the present model, in the same round."""
    then = search.fits.get(key, {}).get(rival)
    beside = {each for each in search.fit.keys if each != key}
    return (
        search.accepted()[-1] == key
        and then is not None
        and {each for each in then.keys if each != rival} == beside
    )


def _approached(search: Search, fit: Fit) -> Fit:
    """``fit`` with the twin as accurate for it as for the accepted model."""
    if set(fit.model) != set(search.fit.model):
        # Sites of one effect share what the finer mesh says of it.
        search.counted.approach(fit.model)
    fit = replace(fit, residual=search.counted.residual(fit.model))
    return refine(search.counted, fit, search.noise, iterations=search.settings.iterations)


def _rival_fits(
    search: Search, key: str, confounding: Confounding, told: Progress
) -> dict[str, Fit]:
    """Models in which a rival takes the place of ``key``."""
    fits = search.fits.get(key, {})
    names = list(dict.fromkeys((*fits, *confounding.alike(key, _ALIKE)[:_MOST])))
    mine = search.sketch.candidate(key)
    others = [c for c in search.fit.candidates if c.key != key]
    found: dict[str, Fit] = {}
    less: Fit | None = None
    for name in names:
        rival = search.sketch.candidate(name)
        if name == key or rival.base or any(conflicts(rival, other) for other in others):
            continue
        if rival.nuisance and not mine.nuisance:
            continue  # re-tuned along all the time: it did not explain what was named
        if mine.effect.name in rival.effect.special_cases:
            continue  # it would say the same in more words
        if _stood_together(search, key, name):
            found[name] = fits[name]
            continue
        if less is None:
            less = without(
                search.counted, search.fit, key, search.noise, iterations=search.settings.iterations
            )
        if _far_behind(search, less, name, key):
            continue
        told(f"whether {name} explains the same as {key}", 0.5)
        fit = _begun_from_ranking(search, less, name, key)
        if fit is not None:
            found[name] = fit
    return found


def _far_behind(search: Search, less: Fit, name: str, key: str) -> bool:
    """Whether, beside the other causes, ``name`` explains so much less than ``key`` on the
    linearised model that no full fit would bring it near."""
    now = board(search.sketch, less.jacobian, search.samples.fold, [name, key])
    found = whitened_products(now, search.noise, np.nan_to_num(less.residual)[:, None])
    scores = score(now, found)
    return float(scores.statistic(name)[0]) < _BEHIND * float(scores.statistic(key)[0])


def _begun_from_ranking(search: Search, less: Fit, name: str, key: str) -> Fit | None:
    nuisances = [
        c.key
        for c in search.sketch.candidates
        if c.nuisance and c.key not in (name, key) and c.key not in less.keys
    ]
    now = board(search.sketch, less.jacobian, search.samples.fold, [name, *nuisances])
    if not now.of_option[name]:
        return None
    found = whitened_products(now, search.noise, np.nan_to_num(less.residual)[:, None])
    option, amplitudes = start_of(now, found, name, int(score(now, found).option[name][0]))
    return extend(
        search.counted,
        less,
        [Addition(search.sketch.candidate(name), option, amplitudes)],
        search.noise,
        iterations=search.settings.iterations,
    )


def _rejected(search: Search, key: str, rival: str, mine: Fit, fit: Fit) -> bool:
    """Whether data made by ``rival``, with its ``fit``, would hardly ever speak for ``key``, with
    the fit ``mine``, as the measured do."""
    return _chance(search, key, rival, mine, fit) < search.settings.alike


def _chance(search: Search, key: str, rival: str, mine: Fit, fit: Fit) -> float:
    """Share of data made by ``rival``, with its ``fit``, on which ``key``, with the fit ``mine``,
    is as far ahead as on the measured; 1 where it is not ahead at all."""
    columns = {
        name: search.tuned_columns(one, key, rival)
        for name, one in (("mine", mine), ("rival", fit))
    }
    noise, fold = search.noise, search.samples.fold
    white = {name: noise.whiten(one) for name, one in columns.items()}

    def ahead(mine_left: Floats, rival_left: Floats) -> Floats:
        total = {
            name: losses(
                products(white[name], noise.whiten(left), fold), np.arange(white[name].shape[1])
            ).total
            for name, left in (("mine", mine_left), ("rival", rival_left))
        }
        return np.asarray(total["rival"] - total["mine"])

    seen = noise.seen
    mine_left = np.where(seen, mine.residual, 0.0)[:, None]
    rival_left = np.where(seen, fit.residual, 0.0)[:, None]
    measured = float(ahead(mine_left, rival_left)[0])
    if measured <= 0.0:
        return 1.0
    apart = mine_left - rival_left
    count, by_chance, begun = search.settings.surrogates, [], 0
    off = search.approximations(count)
    for drawn in surrogates(noise, mine.residual, count, search.rng):
        here = slice(begun, begun + drawn.shape[1])
        begun = here.stop
        if off is not None:
            drawn = drawn + np.where(seen[:, None], off[:, here], 0.0)
        by_chance.append(ahead(drawn + apart, drawn))
    return float(np.mean(np.concatenate(by_chance) >= measured))
