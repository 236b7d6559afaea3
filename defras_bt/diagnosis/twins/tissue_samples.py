"""Labels of the numbers that are compared, and what their sensors scatter."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from defras_bt.diagnosis.problem import Integers, Samples
from defras_bt.diagnosis.twins.tissue_frames import TissueFrames
from defras_bt.diagnosis.twins.tissue_noise import noise_sd
from defras_bt.diagnosis.twins.tissue_phases import PHASES
from defras_bt.diagnosis.twins.tissue_signals import Layout, gone_m
from defras_bt.diagnosis.twins.tissue_trajectory import Trajectory
from defras_sim.geometry import Floats

BLOCKS = 8
"""Stretches of time of a recording that are held out one at a time."""
WHOLE_FROM = 5
"""From so many recordings on, each is held out as a whole."""
LEFT_OF_MESH = 0.5
"""Of the correction: what the mesh still gets wrong after it. Half as large elements leave a third
of the error that they remove if it goes with their size squared, as much if with their size."""


def samples_of(
    layout: Layout,
    trajectories: Sequence[Trajectory],
    plain: Sequence[TissueFrames],
    residual: Sequence[Floats],
    corrected: Sequence[Floats],
) -> Samples:
    """Samples of all ``trajectories``, of which the plain model says ``plain`` and leaves
    ``residual`` (rows, frames) each, by ``corrected`` (rows, frames) less than without the
    correction of its mesh."""
    kinds = np.repeat(
        [0, 1, 2], [len(layout.grid), 3 * len(layout.with_force), 3 * len(layout.with_tip)]
    )
    noise = noise_sd(residual, [each.phase for each in trajectories], kinds)
    forces = [f for each in trajectories for f in each.forces_n.values()]
    largest = [float(np.nanmax(np.linalg.norm(f, axis=1), initial=0.0)) for f in forces]
    gone = np.max([gone_m(frames, layout.grid) for frames in plain], axis=0)
    off = _of_mesh(corrected, [each.phase for each in trajectories])
    whole = len(trajectories) >= WHOLE_FROM
    times, channels, owners, phases, folds = [], [], [], [], []
    for number, each in enumerate(trajectories):
        rows, count = layout.rows, len(each.frames)
        fold = np.full(count, number) if whole else number * BLOCKS + _blocks_of(each.phase, BLOCKS)
        times.append(np.tile(each.time_s, rows))
        channels.append(np.repeat(np.arange(rows), count))
        owners.append(np.full(rows * count, number))
        phases.append(np.tile(each.phase, rows))
        folds.append(np.tile(fold, rows))
    return Samples(
        layout.channels(noise, gone, max(largest, default=0.0), off),
        tuple(each.name for each in trajectories),
        PHASES,
        np.concatenate(times),
        np.concatenate(channels).astype(np.int64),
        np.concatenate(owners).astype(np.int64),
        np.concatenate(phases).astype(np.int64),
        np.concatenate(folds).astype(np.int64),
    )


def _of_mesh(corrected: Sequence[Floats], phases: Sequence[Integers]) -> Floats:
    """What is left of each row's (rows,) mesh error after the correction, root mean square over the
    frames in which tissue is moved."""
    rest = PHASES.index("rest")
    moved = np.concatenate(
        [each[:, phase != rest] for each, phase in zip(corrected, phases, strict=True)], axis=1
    )
    count = np.maximum(np.isfinite(moved).sum(axis=1), 1)
    return np.asarray(LEFT_OF_MESH * np.sqrt(np.nansum(moved**2, axis=1) / count))


def _blocks_of(phase: Integers, count: int) -> Integers:
    """Contiguous blocks (f,) of frames, all with as much of the time in which something happens.

    Frames at rest are all alike: together they are worth one block.
    """
    rest = phase == PHASES.index("rest")
    weight = np.where(rest, 1.0 / max(1, int(rest.sum())), 0.0)
    moving = ~rest
    weight[moving] = (count - 1) / max(1, int(moving.sum()))
    if not rest.any():
        weight = np.full(len(phase), count / len(phase))
    done = np.cumsum(weight) - weight / 2
    return np.clip(done * (count / max(float(weight.sum()), 1e-12)), 0, count - 1e-9).astype(
        np.int64
    )
