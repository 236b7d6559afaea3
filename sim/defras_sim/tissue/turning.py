"""How tissue has turned, node by node, between two shapes.

The tangent of tissue that has only turned is the old one, turned. So a factorisation made some
millimetres of a fold ago still fits when forces are turned back to it and motions forth from it;
without that, the stiff directions of a sheet soon lie across its soft ones. Compare Hecht et al.,
ACM Trans. Graph. 31 (2012) 123, who turn the factor itself.
"""

from __future__ import annotations

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.tissue.matrices import jit, rotation
from defras_sim.tissue.mesh import Integers


@jit
def node_rotations(
    starts: Integers, neighbours: Integers, before_m: Floats, after_m: Floats
) -> Floats:
    """The rotation (nodes, 3, 3) of each node's neighbourhood from ``before_m`` to ``after_m``.

    The one that turns the ways to its neighbours best, in the sense of least squares.
    ``neighbours[starts[i] : starts[i + 1]]`` are those of node i; positions are (nodes, 3).
    """
    count = len(before_m)
    rotations = np.empty((count, 3, 3))
    moments = np.empty((3, 3))
    for node in range(count):
        moments[:] = 0.0
        for k in range(starts[node], starts[node + 1]):
            other = neighbours[k]
            for i in range(3):
                way = after_m[other, i] - after_m[node, i]
                for j in range(3):
                    moments[i, j] += way * (before_m[other, j] - before_m[node, j])
        rotation(moments, rotations[node])
    return rotations


@jit
def turned(rotations: Floats, vectors: Floats, back: bool) -> Floats:
    """``vectors`` (nodes, 3) turned by each node's rotation, or turned back."""
    out = np.empty_like(vectors)
    for node in range(len(vectors)):
        for i in range(3):
            total = 0.0
            for j in range(3):
                factor = rotations[node, j, i] if back else rotations[node, i, j]
                total += factor * vectors[node, j]
            out[node, i] = total
    return out
