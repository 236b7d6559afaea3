"""How far the twin's own approximations may move a fitted number.

However long a recording is, the twin remains as far off on each patch of tissue, in each phase of
the motion, as its mesh and its idea of a jaw make it. Such errors are taken for independent from
patch to patch and phase to phase, and carried through the fit.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from defras_bt.diagnosis.noise import tolerances
from defras_bt.diagnosis.problem import Candidate, Samples, Tangent
from defras_sim.geometry import Floats

SHARE = 0.5
"""Of a channel's floor: standard deviation of what is wrong in it throughout a phase."""


def systematic_errors(
    samples: Samples, residual: Floats, candidate: Candidate, tangents: Sequence[Tangent]
) -> dict[str, float]:
    """Standard error by free parameter, in its unit; 0 for those that ``tangents`` do not move.

    ``residual`` (n,) says which numbers are compared.
    """
    columns: dict[str, Floats] = {}
    for tangent in tangents:
        for step, column in zip(tangent.steps, tangent.columns.T, strict=True):
            if len(step) == 1:
                ((name, size),) = step.items()
                columns.setdefault(name, column / size)
    names = [p.name for p in candidate.free if p.name in columns]
    steps = np.array([p.step for p in candidate.free if p.name in columns])
    found = {p.name: 0.0 for p in candidate.free}
    if not names:
        return found
    matrix = np.stack([columns[name] for name in names], axis=1) * steps
    known = np.isfinite(residual) & np.isfinite(matrix).all(axis=1)
    tolerance = tolerances(samples)[samples.channel]
    white = matrix[known] / tolerance[known, None]
    floor = np.array([channel.floor for channel in samples.channels])
    off = SHARE * (floor[samples.channel] / tolerance)[known]
    # One unknown error for each channel, trajectory and phase, the same in all of its samples.
    shape = (len(samples.channels), len(samples.trajectories), len(samples.phases))
    together = np.ravel_multi_index((samples.channel, samples.trajectory, samples.phase), shape)
    _, group = np.unique(together[known], return_inverse=True)
    sums = np.stack([np.bincount(group, weights=column * off) for column in white.T], axis=1)
    # Directions that nothing shows are not moved by errors either.
    inverse = np.linalg.pinv(white.T @ white, rcond=1e-9, hermitian=True)
    spread = inverse @ (sums.T @ sums) @ inverse
    for name, step, variance in zip(names, steps, np.diag(spread), strict=True):
        found[name] = float(np.sqrt(max(variance, 0.0)) * step)
    return found
