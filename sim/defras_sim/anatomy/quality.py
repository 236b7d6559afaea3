"""Whether a volume mesh can be computed with."""

from __future__ import annotations

import numpy as np

from defras_sim.anatomy.anatomy import VolumeMesh
from defras_sim.anatomy.refused import RefusedSurface
from defras_sim.geometry import Floats
from defras_sim.tissue.tetrahedra import EDGES, FACES

# A regular tetrahedron has 1. Below this, one element would spoil the conditioning of all.
WORST_QUALITY = 0.05
# Of the volume.
_VOLUME_TOLERANCE = 0.03


def qualities(mesh: VolumeMesh) -> Floats:
    """Shape (t,) of each tetrahedron: volume over cubed edge length (root mean square), 0 to 1."""
    corners = mesh.nodes_m[mesh.tetrahedra]
    volume = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6
    first, second = (list(ends) for ends in zip(*EDGES, strict=True))
    squares = np.sum((corners[:, first] - corners[:, second]) ** 2, axis=2).mean(axis=1)
    return np.asarray(6 * np.sqrt(2) * volume / squares**1.5)


def volume_m3(mesh: VolumeMesh) -> float:
    """Volume of all tetrahedra together."""
    corners = mesh.nodes_m[mesh.tetrahedra]
    return float(np.linalg.det(corners[:, 1:] - corners[:, :1]).sum()) / 6


def require_sound(mesh: VolumeMesh, expected_m3: float) -> None:
    """Raises RefusedSurface where a mesh is inverted, degenerate, torn, or of another volume."""
    if not len(mesh.tetrahedra):
        raise RefusedSurface("the mesher found no inside; the surface may be flat")
    worst = float(qualities(mesh).min())
    if worst < WORST_QUALITY:
        raise RefusedSurface(
            f"the mesh has an element of quality {worst:.3f} (a regular tetrahedron has 1, at "
            f"least {WORST_QUALITY} is needed); smooth the surface, or make the tissue thicker"
        )
    faces = np.sort(mesh.tetrahedra[:, FACES].reshape(-1, 3), axis=1)
    if np.unique(faces, axis=0, return_counts=True)[1].max() > 2:
        raise RefusedSurface("three elements of the mesh share one face; smooth the surface")
    volume = volume_m3(mesh)
    if abs(volume / expected_m3 - 1) > _VOLUME_TOLERANCE:
        raise RefusedSurface(
            f"the mesh has {1e6 * volume:.1f} cm3 of the tissue's {1e6 * expected_m3:.1f}; "
            "details of the surface are finer than its elements can be: smooth it"
        )
