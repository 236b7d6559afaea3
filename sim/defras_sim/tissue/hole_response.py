"""How a tissue in equilibrium answers to small forces where its holes hold it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.tissue.discs import ROWS
from defras_sim.tissue.mesh import Integers
from defras_sim.tissue.response import Solve
from defras_sim.tissue.springs import SpringTerm
from defras_sim.tissue.surface import SurfaceMap


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


def hole_response(
    attachments: SpringTerm,
    positions_m: Floats,
    surface: SurfaceMap,
    solve: Solve,
    holes: Integers,
) -> HoleResponse:
    """The response at the equilibrium ``positions_m`` (nodes, 3), where ``solve`` belongs to."""
    chosen = np.asarray(holes, dtype=np.int64)
    rows = (ROWS * chosen[:, None] + np.arange(ROWS)).ravel()
    on_mesh = attachments.springs.rows[rows]
    pulls = attachments.pulls(positions_m)
    # What a force on the held tissue leaves for the mesh after the dent has taken its share.
    reaching = pulls.passed_on[rows]
    nodes, count, size = len(positions_m), len(chosen), 3 * ROWS
    forces = np.einsum("rn,rij->nirj", on_mesh.toarray(), reaching)
    by_node = solve(forces.reshape(3 * nodes, -1)).reshape(nodes, -1)
    held = reaching @ (on_mesh @ by_node).reshape(len(rows), 3, -1)
    each = np.arange(len(rows))
    held.reshape(len(rows), 3, len(rows), 3)[each, :, each] += pulls.held_by_force[rows]
    return HoleResponse(
        (surface.from_nodes @ by_node).reshape(-1, 3, count, size),
        held.reshape(count, size, count, size),
        (pulls.held_m - attachments.targets_m)[rows].reshape(count, size),
    )
