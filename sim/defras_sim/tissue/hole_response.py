"""How a tissue in equilibrium answers to small forces where its holes hold it."""

from __future__ import annotations

from dataclasses import dataclass

from defras_sim.geometry import Floats


@dataclass(frozen=True)
class HoleResponse:
    """Linear response at one equilibrium.

    A hole holds the mean and the two first moments of the disc over it, 9 numbers in all: x, y, z
    of each in turn. ``surface_m_per_n`` (vertices, 3, holes, 9) and ``holes_m_per_n`` (holes, 9,
    holes, 9): motion (first indices) per force (last two). ``stretch_m`` (holes, 9): how far the
    tissue over each hole lies from where the hole would hold it.
    """

    surface_m_per_n: Floats
    holes_m_per_n: Floats
    stretch_m: Floats
