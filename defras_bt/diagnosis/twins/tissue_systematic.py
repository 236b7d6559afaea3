"""How far the twin's own approximations may move a fitted number."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from defras_bt.diagnosis.noise import tolerances
from defras_bt.diagnosis.problem import Candidate, Samples
from defras_bt.diagnosis.twins.tissue_approximation import RELATIVE, approximation_errors
from defras_bt.diagnosis.twins.tissue_samples import LEFT_OF_MESH
from defras_sim.geometry import Floats

_DRAWS = 200


def systematic_errors(
    samples: Samples,
    residual: Floats,
    candidate: Candidate,
    columns: Mapping[str, Floats],
    corrected: Floats,
    explained: Floats | None,
    rng: np.random.Generator,
) -> dict[str, float]:
    """Standard error by free parameter, in its unit; 0 for those without one of ``columns``, the
    change (n,) of the predictions per unit.

    However long a recording is, the twin remains as far off as it is: draws of its errors are
    carried through the fit. ``residual`` (n,) says which numbers are compared. What the finer mesh
    ``corrected`` (n,) tells the shape of what is still wrong: a part of the same goes on with
    every further refinement (Richardson), so draws have it too, more or less of it; and so they
    have of what accepted causes ``explained`` (n,), of which too much or too little changes their
    strengths and leaves nothing over.
    """
    names = [p.name for p in candidate.free if p.name in columns]
    steps = np.array([p.step for p in candidate.free if p.name in columns])
    found = {p.name: 0.0 for p in candidate.free}
    if not names:
        return found
    matrix = np.stack([columns[name] for name in names], axis=1) * steps
    known = np.isfinite(residual) & np.isfinite(matrix).all(axis=1)
    tolerance = tolerances(samples)[samples.channel][known, None]
    white = matrix[known] / tolerance
    # Directions that nothing shows are not moved by errors either.
    inverse = np.linalg.pinv(white.T @ white, rcond=1e-9, hermitian=True)
    drawn = approximation_errors(samples, _DRAWS, rng, explained)
    known_shapes = [(LEFT_OF_MESH, corrected)]
    if explained is not None:
        known_shapes.append((RELATIVE, explained))
    for share, shape in known_shapes:
        drawn += share * np.outer(np.nan_to_num(shape), rng.standard_normal(_DRAWS))
    drawn = drawn[known] / tolerance
    spread = (inverse @ (white.T @ drawn)).std(axis=1)
    for name, step, sd in zip(names, steps, spread, strict=True):
        found[name] = float(sd * step)
    return found
