"""Which causes look alike with given motions, known before anything is measured."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

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
    projected: dict[tuple[str, ...], Floats] = {}
    for index, key in enumerate(keys):
        fitted_along = [*always, *candidates.nuisances(key)]
        names = tuple(option.key for option in fitted_along)
        if names not in projected:
            projected[names] = _basis(fitted_along, weighed, len(tolerance))
        others = projected[names]
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
    return Confounding(keys, _cosines([bases[key] for key in keys]), shift, shift_after)


def _cosines(bases: Sequence[Sequence[Floats]]) -> Floats:
    """Largest cosine (k, k) between what two candidates can do, in any of their ways: ``bases`` has
    for each an orthonormal one (n, m) of every way."""
    cosine = np.eye(len(bases))
    stacks = [np.concatenate(own, axis=1) if own else np.zeros((0, 0)) for own in bases]
    ends = [np.cumsum([0, *(one.shape[1] for one in own)]) for own in bases]
    for i, first in enumerate(stacks):
        for j in range(i):
            if not first.size or not stacks[j].size:
                continue
            product = first.T @ stacks[j]
            found = 0.0
            for top, bottom in pairwise(ends[i]):
                if np.linalg.norm(product[top:bottom]) <= found:
                    continue  # no block is larger in its 2-norm
                for start, stop in pairwise(ends[j]):
                    block = product[top:bottom, start:stop]
                    # Of a row or a column the 2-norm is its length.
                    order = 2 if min(block.shape) > 1 else None
                    found = max(found, float(np.linalg.norm(block, order)))
            cosine[i, j] = cosine[j, i] = min(found, 1.0)
    return cosine


def _basis(options: list[Option], weighed: Callable[[Floats], Floats], size: int) -> Floats:
    stack = [weighed(option.columns) for option in options]
    return _orthonormal(np.concatenate(stack, axis=1)) if stack else np.zeros((size, 0))


def _orthonormal(columns: Floats) -> Floats:
    left, size, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(left[:, size > 1e-9 * max(float(size.max(initial=0.0)), 1e-300)])
