"""What the twin says of the keyframes under one belief: what networks compare the clouds with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from defras_sim.geometry import Floats
from defras_sim.surface import Surface
from defras_sim.tissue.state import TissueState


@dataclass(frozen=True)
class Predicted:
    """``rest``: the twin's surface where nobody holds the tissue. By keyframe: ``surfaces``, with
    the triangles of ``rest``, and ``hole_forces_n`` (holes, 3) on the tissue."""

    rest: Surface
    surfaces: tuple[Surface, ...]
    hole_forces_n: tuple[Floats, ...]

    @staticmethod
    def of(rest: Surface, states: Sequence[TissueState]) -> Predicted:
        return Predicted(
            rest,
            tuple(state.surface for state in states),
            tuple(state.attachment_forces_n for state in states),
        )
