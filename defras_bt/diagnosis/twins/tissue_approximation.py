"""What the twin itself may be off by: draws of the errors that its mesh and its idea of a jaw make.

Such errors are the same for as long as the tissue is in the same shape, and much the same on
neighbouring patches. So each draw is a smooth field over the tissue that stays throughout (as do
errors of a camera that its scatter at rest does not tell), and another one for each phase of the
motion; forces are off by a share of the largest one. How large errors are follows from the floors
of the channels, which say how far models of one and the same tissue on different meshes differ:
they are known before any data. What an accepted cause does is no better known than the twin's mesh
lets it be: a share of that is wrong too, or else the largest cause would have weaker ones named
beside it for what the mesh makes of it.

Where two meshes disagree by much more than floors say, as where tissue is pushed together and
buckles one way or the other, neither is to be trusted: half of the difference may be wrong still.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defras_bt.diagnosis.problem import Samples
from defras_bt.diagnosis.twins.tissue_phases import PHASES
from defras_bt.diagnosis.twins.tissue_samples import LEFT_OF_MESH
from defras_sim.geometry import Floats

SHARE = 0.5
"""Of a channel's floor: standard deviation of what is wrong in it."""
RELATIVE = 0.03
"""Of what accepted causes change: standard deviation of what is wrong in it. Two fine meshes,
hexahedra and tetrahedra of 16 x 16, differ by 3 % in how far gravity moves a folded slab;
tetrahedra of 10 x 10 by 3 % more."""
ALIKE_M = 0.02
"""Distance over which the errors of patches are alike."""


def approximation_errors(
    samples: Samples,
    count: int,
    rng: np.random.Generator,
    explained: Floats | None = None,
    corrected: Floats | None = None,
) -> Floats:
    """Draws (n, count) of the twin's own errors in the numbers that are compared; ``explained``
    (n,): what accepted causes of tissue and arms change of its predictions, if any are.
    ``corrected`` (n,): what the finer mesh put right of them."""
    sd = np.array([SHARE * channel.floor for channel in samples.channels])
    field = _field(samples)
    found = np.zeros((len(samples.time_s), count))
    rest = PHASES.index("rest")
    for trajectory in np.unique(samples.trajectory):
        mine = samples.trajectory == trajectory
        lasting = field @ rng.standard_normal((len(sd), count))
        for phase in np.unique(samples.phase[mine]):
            passing = np.zeros_like(lasting)
            if phase != rest:
                passing = field @ rng.standard_normal((len(sd), count))
            rows = mine & (samples.phase == phase)
            size = sd
            if explained is not None:
                size = np.hypot(sd, RELATIVE * _root_mean_square(samples, rows, explained))
            drawn = size[:, None] * (lasting + passing) / np.sqrt(2.0)
            found[rows] = drawn[samples.channel[rows]]
            if corrected is not None:
                beyond = _beyond(corrected[rows], size[samples.channel[rows]])
                found[rows] += np.outer(beyond, rng.standard_normal(count))
    return found


def _beyond(corrected: Floats, size: Floats) -> Floats:
    """What (n,) may be left of a correction beyond errors of standard deviation ``size`` (n,)."""
    left = LEFT_OF_MESH * np.nan_to_num(corrected)
    return np.asarray(np.sign(left) * np.sqrt(np.maximum(left**2 - size**2, 0.0)))


def _root_mean_square(samples: Samples, rows: NDArray[np.bool_], values: Floats) -> Floats:
    """By channel (c,), of ``values`` (n,) over ``rows``."""
    known = rows & np.isfinite(values)
    count = np.bincount(samples.channel[known], minlength=len(samples.channels))
    total = np.bincount(samples.channel[known], values[known] ** 2, minlength=len(samples.channels))
    return np.asarray(np.sqrt(total / np.maximum(count, 1)))


def _field(samples: Samples) -> Floats:
    """Matrix (c, c) from independent numbers to one of unit variance for each channel, alike in
    neighbouring patches of one face, independent otherwise."""
    count = len(samples.channels)
    alike = np.eye(count)
    faces = [channel.name.split(" ")[0] for channel in samples.channels]
    for face in dict.fromkeys(faces):
        own = [
            i
            for i, channel in enumerate(samples.channels)
            if faces[i] == face and channel.place_m is not None
        ]
        if own:
            places = np.array([samples.channels[i].place_m for i in own])
            apart = np.linalg.norm(places[:, None] - places[None], axis=2)
            alike[np.ix_(own, own)] = np.exp(-((apart / ALIKE_M) ** 2) / 2)
    value, vector = np.linalg.eigh(alike)
    return np.asarray(vector * np.sqrt(np.maximum(value, 0.0)))
