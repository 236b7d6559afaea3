"""An element's tangent as blocks of nodes, compiled: summed over points, then put in the matrix."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Floats
from defras_sim.tissue.matrices import jit


@jit
def add_point(block: Floats, slopes: Floats, A: Floats, volume: float) -> None:
    """Add one point's part to ``block`` (3, 3, nodes, nodes), of which only k >= i is used.

    ``slopes`` (3, nodes): rest gradients of the shape functions; ``A`` (9, 9): dP/dF, symmetric.
    """
    width = slopes.shape[1]
    for i in range(3):
        for k in range(i, 3):
            target = block[i, k]
            for a in range(width):
                x = y = z = 0.0
                for j in range(3):
                    g = volume * slopes[j, a]
                    x += g * A[3 * i + j, 3 * k]
                    y += g * A[3 * i + j, 3 * k + 1]
                    z += g * A[3 * i + j, 3 * k + 2]
                for b in range(width):
                    target[a, b] += x * slopes[0, b] + y * slopes[1, b] + z * slopes[2, b]


@jit
def add_to_matrix(block: Floats, places: NDArray[np.int32], entries: Floats) -> None:
    """Add an element's ``block`` to the matrix ``entries``.

    ``places`` (a, b, 3): entry of row 3 a in column 3 b + k, before the next two rows.
    """
    width = block.shape[2]
    for b in range(width):
        for a in range(width):
            for k in range(3):
                place = places[a, b, k]
                for i in range(3):
                    if i <= k:
                        entries[place + i] += block[i, k, a, b]
                    else:
                        entries[place + i] += block[k, i, b, a]
