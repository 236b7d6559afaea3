"""Discs of the tissue's faces, by which attachments and jaws hold it.

A disc is held by its mean position and its two first moments: what is needed to resist translation
and rotation, and no more. They are interpolated in the mesh, so that refining it changes neither
what is held nor how firmly. (Holding every point of the disc as firmly stiffens coarse meshes,
where the whole element has to follow.)
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from defras_sim.geometry import Floats
from defras_sim.rest_shape import Face
from defras_sim.tissue.mesh import Mesh

# Means over the unit disc: Gauss points in the squared radius times equal angles, exact to degree
# 7. So many that a fine mesh sees a pressure: seven points of degree 5 would prick it, and read a
# fifth less force on 24x24x2 elements.
_RINGS, _SPOKES = 4, 16


def _unit_disc() -> tuple[Floats, Floats]:
    """Points (n, 2) and weights (n,) of the mean over the unit disc."""
    x, w = np.polynomial.legendre.leggauss(_RINGS)
    radius = np.sqrt((x + 1) / 2)
    angle = (np.arange(_SPOKES) + 0.5) * 2 * np.pi / _SPOKES
    spokes = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = (radius[:, None, None] * spokes).reshape(-1, 2)
    return points, np.repeat(w / 2 / _SPOKES, _SPOKES)


DISC_POINTS, _WEIGHTS = _unit_disc()

# Rows of a disc: mean, and first moments along x and y, orthonormal over the disc, so that each
# takes the patch's stiffness in N/m.
ROWS = 3
DISC_MOMENTS: Floats = (
    np.stack([np.ones(len(_WEIGHTS)), 2 * DISC_POINTS[:, 0], 2 * DISC_POINTS[:, 1]]) * _WEIGHTS
)
# Only the mean moves with a translation.
ROW_SHIFTS: Floats = np.array([1.0, 0.0, 0.0])


def disc_rows(mesh: Mesh, centers_xy_m: Floats, radius_m: float, face: Face) -> sparse.csr_array:
    """Rows (3 discs, nodes) of discs around ``centers_xy_m`` (discs, 2) on ``face``.

    A disc lies in the face's tangent plane there, brought onto the face along z; one that reaches
    over the rim is squeezed into the face.
    """
    centers = np.asarray(centers_xy_m, dtype=float)
    spread = DISC_POINTS @ face.tangents(centers)[..., :2]  # (discs, points, 2)
    points = face.at(centers[:, None, :] + radius_m * spread).reshape(-1, 3)
    moments = sparse.kron(sparse.eye_array(len(centers)), DISC_MOMENTS, format="csr")
    return sparse.csr_array(moments @ mesh.interpolation(points))


def net_force(forces_n: Floats) -> Floats:
    """Force (discs, 3) of discs from their springs' forces (3 discs, 3)."""
    return forces_n.reshape(-1, ROWS, 3)[:, 0]
