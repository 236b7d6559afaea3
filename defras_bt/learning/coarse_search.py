"""Most of the way to the attachments, on a mesh on which a round takes a fraction of a second."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from defras_bt.learning.cost import SearchSettings
from defras_bt.learning.estimate import Keyframe
from defras_bt.learning.hold_out import Split
from defras_bt.learning.replay import Replay
from defras_bt.learning.search import AttachmentSearch, Mask
from defras_sim.scene import Scene

CELL_M = 0.02
"""Size of the coarse mesh's elements."""
ROUNDS = 8


def coarse_search(
    belief: Scene,
    keyframes: Sequence[Keyframe],
    parts: Split,
    settings: SearchSettings,
    cell_m: float = CELL_M,
    rounds: int = ROUNDS,
) -> Mask:
    """The set (holes,) that a search from the belief finds on elements of ``cell_m``; tetrahedra
    stay as they are.

    Raises:
        NotRepeatable: the model cannot follow the motion.
    """
    tissue = belief.tissue
    cells = np.array([tissue.length_x_m, tissue.width_y_m]) / cell_m
    x, y = (max(2, int(np.ceil(count - 1e-9))) for count in cells)
    coarse = (x, y, 1) if tissue.element == "hexahedron20" else tissue.elements_xyz
    replay = Replay(belief, keyframes, coarse)
    replay.repeat(belief.hole_stiffness_n_per_m(belief.attached))
    searcher = AttachmentSearch(belief, replay, parts.fitted_points_m, parts.fitted, settings)
    return searcher.run(belief.attached, rounds).attached
