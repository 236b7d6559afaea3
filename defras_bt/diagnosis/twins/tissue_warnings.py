"""How often monitoring would have warned, with the plain and with the extended model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from defras_bt.diagnosis.problem import Integers
from defras_bt.diagnosis.twins.tissue_phases import PHASES
from defras_sim.geometry import Floats


def warning_states(
    cloud_m: Sequence[Floats], phases: Sequence[Integers], delta_m: Sequence[float]
) -> Integers:
    """Warning state 0..3 of every frame after the rest, of all recordings.

    ``cloud_m`` (cells, frames): mean distance of each patch's points off the model. The worst patch
    counts, less what it was at rest; beyond each of ``delta_m`` (3,) lies another state.
    """
    found = []
    for each, phase in zip(cloud_m, phases, strict=True):
        seen = np.isfinite(each).any(axis=0)
        worst = np.zeros(each.shape[1])
        worst[seen] = np.nanmax(np.abs(each[:, seen]), axis=0)
        rest = phase == PHASES.index("rest")
        calm = float(worst[rest & seen].mean()) if np.any(rest & seen) else 0.0
        above = np.maximum(worst - calm, 0.0)[~rest]
        found.append((above[:, None] > np.asarray(delta_m)).sum(axis=1))
    return np.concatenate(found).astype(np.int64)


def warnings_remark(plain: Integers, extended: Integers) -> str:
    """What the extended model changes of the warning states (frames,) that the plain one gives."""

    def told(states: Integers) -> str:
        count = max(len(states), 1)
        by_state = [int((states == state).sum()) for state in (1, 2, 3)]
        shares = ", ".join(f"{n / count:.0%} in state {i}" for i, n in enumerate(by_state, 1))
        return f"{int((states > 0).sum()) / count:.0%} of the frames after the rest ({shares})"

    return (
        f"With the plain model monitoring would have warned in {told(plain)}, with the extended "
        f"one in {told(extended)}."
    )
