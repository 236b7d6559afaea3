"""How a tissue in equilibrium answers to small forces at its holes."""

from __future__ import annotations

from dataclasses import dataclass

from defras_sim.geometry import Floats


@dataclass(frozen=True)
class HoleResponse:
    """Linear response at one equilibrium to a force, spread over a hole's disc, at each hole.

    ``surface_m_per_n`` (vertices, 3, holes, 3) and ``holes_m_per_n`` (holes, 3, holes, 3): motion
    (first indices) per force (last two). ``stretch_m`` (holes, 3): how far the tissue over each
    hole lies from it now.
    """

    surface_m_per_n: Floats
    holes_m_per_n: Floats
    stretch_m: Floats
