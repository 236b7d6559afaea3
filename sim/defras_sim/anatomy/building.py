"""From tissue to an anatomy file: both meshes, and the surface that cameras and jaws meet."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from defras_sim.anatomy.anatomy import Anatomy, MeshName, VolumeMesh, write_anatomy
from defras_sim.anatomy.mesher import meshed
from defras_sim.anatomy.sides import sides
from defras_sim.anatomy.solid import Sheet, Solid
from defras_sim.geometry import Floats
from defras_sim.tissue.tetrahedra import FACES

# Of a model with quadratic elements. The twin has to be solved many times a second; what imitates
# reality has smaller elements, so that the twin's mesh is not the truth.
UNKNOWNS: dict[MeshName, tuple[int, int]] = {"twin": (4500, 5600), "actual": (7500, 10500)}


def built(tissue: Solid | Sheet, file: Path, tell: Callable[[str], None]) -> Anatomy:
    """Mesh ``tissue`` and write it to ``file``; ``tell`` hears what is being done.

    The frame's origin is the middle of the box around the tissue in x and y, and the mean of its
    upper face in z.

    Raises:
        RefusedSurface: it cannot be meshed.
    """
    meshes: dict[MeshName, VolumeMesh] = {}
    for name, unknowns in UNKNOWNS.items():
        tell(f"meshing the {name} tissue")
        meshes[name] = meshed(tissue, unknowns, tell)
    vertices, triangles = boundary(meshes["actual"])
    side = sides(vertices, triangles)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    a, b, c = np.moveaxis(vertices[triangles[side == 1]], 1, 0)
    shadow = np.cross(b - a, c - a)[:, 2]
    height = np.average((a + b + c)[:, 2] / 3, weights=shadow)
    middle = np.array([*(low + high)[:2] / 2, height])
    moved = {
        name: VolumeMesh(mesh.nodes_m - middle, mesh.tetrahedra) for name, mesh in meshes.items()
    }
    return write_anatomy(file, (vertices - middle, triangles, side), moved)


def boundary(mesh: VolumeMesh) -> tuple[Floats, NDArray[np.int64]]:
    """A mesh's surface, each face cut in four: small enough to follow quadratic elements."""
    faces = mesh.tetrahedra[:, FACES].reshape(-1, 3)
    _, first, count = np.unique(
        np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
    )
    outer = faces[first[count == 1]]
    edges, number = np.unique(
        np.sort(outer[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1),
        axis=0,
        return_inverse=True,
    )
    ab, bc, ca = (len(mesh.nodes_m) + number.reshape(-1, 3)).T
    a, b, c = outer.T
    quarters = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    triangles = np.concatenate([np.stack(corners, axis=1) for corners in quarters])
    points = np.concatenate([mesh.nodes_m, mesh.nodes_m[edges].mean(axis=1)])
    used, packed = np.unique(triangles, return_inverse=True)
    return points[used], packed.reshape(-1, 3)
