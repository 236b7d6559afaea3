"""Which sets of attachments are worth trying, and which holes worth changing, by a proposal."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from defras_bt.learning.networks.propose import Proposal
from defras_bt.learning.search import Mask
from defras_sim.scene import Scene


def candidate_sets(
    belief: Scene, proposals: Sequence[Proposal], sure: Sequence[float]
) -> list[Mask]:
    """Sets (holes,) that differ from the belief and from each other.

    Per proposal, a hole is changed where the network says with a probability of at least ``sure``
    that it is otherwise than believed, for each value of ``sure``.
    """
    found: list[Mask] = []
    believed = belief.attached
    for proposal in proposals:
        otherwise = np.where(believed, 1.0 - proposal.probability, proposal.probability)
        for least in sure:
            changed = believed ^ ((otherwise >= least) & belief.is_hole)
            known = [believed, *found]
            if changed.any() and not any(np.array_equal(changed, each) for each in known):
                found.append(changed)
    return found


def open_questions(
    belief: Scene, proposals: Sequence[Proposal], sets: Sequence[Mask], most: int, least: float
) -> Mask:
    """At most ``most`` holes (holes,) that may well be otherwise than a network says.

    Those that a network gives a chance of ``least`` or more to be otherwise, and those that the
    ``sets`` disagree about, with their neighbours; the most doubtful first.
    """
    nx, ny = belief.hole_counts
    doubt = np.zeros(nx * ny)
    for proposal in proposals:
        wrong = np.minimum(proposal.probability, 1.0 - proposal.probability)
        doubt = np.maximum(doubt, wrong + proposal.uncertainty)
    for each in sets:
        doubt[each != belief.attached] += 0.5
    beside = np.pad(doubt.reshape(ny, nx), 1)
    around = np.max(
        [beside[:-2, 1:-1], beside[2:, 1:-1], beside[1:-1, :-2], beside[1:-1, 2:]], axis=0
    ).ravel()
    doubt = np.where(belief.is_hole, np.maximum(doubt, 0.3 * around), -1.0)
    asked: Mask = doubt >= least
    if asked.sum() > most:
        asked &= doubt >= np.sort(doubt)[-most]
    return asked
