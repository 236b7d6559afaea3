"""The tissue's boundary as triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Floats


@dataclass(frozen=True)
class Surface:
    """Closed triangle surface of the tissue in the tissue frame.

    ``vertices_m`` (n, 3); ``triangles`` (m, 3), outward; ``upper`` (n,) marks vertices of the
    upper face; ``rest_xy_m`` (n, 2) says where each vertex lies on the undeformed slab.
    """

    vertices_m: Floats
    triangles: NDArray[np.int64]
    upper: NDArray[np.bool_]
    rest_xy_m: Floats
