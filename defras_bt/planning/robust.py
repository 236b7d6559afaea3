"""Plans that also work if the attachments are not quite as believed.

Beyond the paper: the believed attachments are one guess. Every retraction is rehearsed on sets of
attachments sampled around it as well, and a retraction counts by how many of them it exposes the
region in, within the force limit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from defras_bt.planning.execution import Execution
from defras_sim.attachment_patches import resized
from defras_sim.scene import Scene

SHARE = (0.4, 1.6)
"""Holding holes of a sampled set as a share of those believed: from fewer to more."""


@dataclass(frozen=True)
class Robustness:
    """A retraction over all sets, the belief among them: where it works, and its mean force."""

    works_in: int
    sets: int
    mean_force_n: float

    def sentence(self) -> str:
        return (
            f"it exposes the region within the force threshold in {self.works_in} of {self.sets} "
            "sets of attachments around the belief"
        )


def sampled_beliefs(scene: Scene, count: int, rng: np.random.Generator) -> list[Scene]:
    """``count`` scenes whose patches of attachments are smaller or larger than believed."""
    nx, ny = scene.hole_counts
    mask = scene.attached.reshape(ny, nx)
    held = int(mask.sum())
    samples = []
    for share in rng.uniform(*SHARE, count):
        holes = int(np.clip(round(share * held), 1, mask.size))
        samples.append(scene.with_attached(resized(mask, holes, rng).ravel()))
    return samples


def robustness(
    execution: Execution,
    elsewhere: Sequence[Sequence[Execution]],
    visibility: float,
    limit_n: float,
) -> Robustness:
    """``execution`` of the believed scene, and what the same retraction does ``elsewhere``."""
    same = [execution, *(carried_out(execution, of_sample) for of_sample in elsewhere)]
    works = sum(e.visibility >= visibility and e.force_max_n <= limit_n for e in same)
    return Robustness(works, len(same), float(np.mean([e.force_max_n for e in same])))


def carried_out(planned: Execution, executions: Sequence[Execution]) -> Execution:
    """Of one scene's ``executions`` the one that ``planned`` would be there.

    It may end early: where the region is exposed sooner, or the tissue cannot be followed.

    Raises:
        ValueError: nothing was rehearsed at that point.
    """
    beginnings = [
        e
        for e in executions
        if e.point == planned.point and e.manoeuvres == planned.manoeuvres[: len(e.manoeuvres)]
    ]
    if not beginnings:
        raise ValueError(f"no rehearsal of {planned.manoeuvres} at {planned.point} to compare with")
    return max(beginnings, key=lambda e: len(e.manoeuvres))


def choose_robust(
    executions: Sequence[Execution],
    elsewhere: Sequence[Sequence[Execution]],
    visibility: float,
    limit_n: float,
) -> tuple[Execution, Robustness] | None:
    """The retraction that works as believed and in most other sets; of equals the gentlest.

    ``executions`` of the believed scene; ``elsewhere``: those of every sample.
    """
    qualified = [e for e in executions if e.visibility >= visibility and e.force_max_n <= limit_n]
    scored = [(e, robustness(e, elsewhere, visibility, limit_n)) for e in qualified]
    return min(
        scored,
        key=lambda pair: (-pair[1].works_in, pair[1].mean_force_n, len(pair[0].manoeuvres)),
        default=None,
    )
