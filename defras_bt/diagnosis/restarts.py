"""Accepted causes are begun anew where, beside those accepted later, another start promises more.

A cause that is accepted early is fitted while others are still missing, and may have stretched to
explain their part. What it became then is no good start once they are there: where derivatives
vanish between one place and another (the width of a play, the place of a slip) no descent leads
from one to the other.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from defras_bt.diagnosis.fitting import Addition, extend, without
from defras_bt.diagnosis.noise import estimate_noise
from defras_bt.diagnosis.ranking import board, remainder, score, start_of, whitened_products
from defras_sim.geometry import Floats

if TYPE_CHECKING:
    from defras_bt.diagnosis.search import Progress, Search


def restart(search: Search, told: Progress) -> bool:
    """Try other starts of each accepted cause that has several; whether any is better.

    One call of the twin each, and a full fit only where the linearised model promises to remove
    more than chance would.
    """
    found = False
    for key in search.accepted():
        if len(search.sketch.options[key]) > 1:
            told(f"whether {key} should begin elsewhere", 0.5)
            found |= _begun_anew(search, key)
    return found


def _begun_anew(search: Search, key: str) -> bool:
    least = search.rounds[-1].threshold
    bare = without(search.counted, search.fit, key, search.noise, iterations=0)
    now = board(search.sketch, bare.jacobian, search.samples.fold, [key])
    residual = np.nan_to_num(bare.residual)
    products = whitened_products(now, search.noise, residual[:, None])
    option = int(score(now, products).option[key][0])
    promised = remainder(now, products, residual, key, option)
    if _loss(search, promised) > (1.0 - least) * _loss(search, search.fit.residual):
        return False
    chosen, amplitudes = start_of(now, products, key, option)
    again = extend(
        search.counted,
        bare,
        [Addition(search.sketch.candidate(key), chosen, amplitudes)],
        search.noise,
        iterations=search.settings.iterations,
    )
    if again is None:
        return False
    present = search.held_out(search.fit, search.noise).total
    if search.held_out(again, search.noise).total > (1.0 - least) * present:
        return False
    search.fit = again
    search.stand()
    search.noise = estimate_noise(search.fit.residual, search.samples, search.layout)
    return True


def _loss(search: Search, residual: Floats) -> float:
    return float((search.noise.whiten(np.nan_to_num(residual)[:, None]) ** 2).sum())
