"""Which causes look alike with given motions, known before anything is measured."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from defras_bt.diagnosis.columns import Option, Sketch, sketch
from defras_bt.diagnosis.diagnosis import Confounding
from defras_bt.diagnosis.noise import Noise, tolerances
from defras_bt.diagnosis.problem import Problem, Samples
from defras_sim.effects.effect import Extension
from defras_sim.geometry import Floats

__all__ = ["Confounding", "confounding_of", "structural_confounding"]


def structural_confounding(problem: Problem, model: Extension) -> Confounding:
    """Confounding of all candidates of ``problem`` near ``model``; needs no data."""
    candidates = sketch(problem, model, problem.candidates)
    return confounding_of(candidates, problem.samples)


def confounding_of(candidates: Sketch, samples: Samples, noise: Noise | None = None) -> Confounding:
    """Cosines between what candidates do, base and nuisances projected out.

    Without ``noise``, numbers are weighed by the tolerance of their channels.
    """
    tolerance = tolerances(samples)[samples.channel][:, None]

    def weighed(columns: Floats) -> Floats:
        return columns / tolerance if noise is None else noise.whiten(columns)

    keys = tuple(c.key for c in candidates.candidates if not c.base)
    always = [
        candidates.options[c.key][0]
        for c in candidates.candidates
        if c.base and candidates.options[c.key]
    ]
    bases: dict[str, list[Floats]] = {}
    shift, shift_after = np.zeros(len(keys)), np.zeros(len(keys))
    for index, key in enumerate(keys):
        others = _basis([*always, *candidates.nuisances(key)], weighed, len(tolerance))
        bases[key] = []
        for option in candidates.options[key]:
            columns = weighed(option.columns)
            left = columns - others @ (others.T @ columns)
            size = np.sqrt(len(columns))
            before, after = float(np.linalg.norm(columns)), float(np.linalg.norm(left))
            shift[index] = max(shift[index], before / size)
            shift_after[index] = max(shift_after[index], after / size)
            if after > 1e-6 * max(before, 1e-12):
                bases[key].append(_orthonormal(left))
    cosine = np.eye(len(keys))
    for i, first in enumerate(keys):
        for j in range(i):
            found = [
                float(np.linalg.norm(one.T @ other, 2))
                for one in bases[first]
                for other in bases[keys[j]]
            ]
            cosine[i, j] = cosine[j, i] = min(max(found, default=0.0), 1.0)
    return Confounding(keys, cosine, shift, shift_after)


def _basis(options: list[Option], weighed: Callable[[Floats], Floats], size: int) -> Floats:
    stack = [weighed(option.columns) for option in options]
    return _orthonormal(np.concatenate(stack, axis=1)) if stack else np.zeros((size, 0))


def _orthonormal(columns: Floats) -> Floats:
    left, size, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(left[:, size > 1e-9 * max(float(size.max(initial=0.0)), 1e-300)])
