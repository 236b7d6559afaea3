"""From a sound surface to the tissue it means: a solid, or a sheet of some thickness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray

from defras_sim.anatomy.refused import RefusedSurface
from defras_sim.anatomy.repair import SoundSurface
from defras_sim.anatomy.sides import STEEPEST, sides, slopes
from defras_sim.anatomy.topology import Topology
from defras_sim.geometry import Floats

Triangles = NDArray[np.int64]

# The flap under the upper side of a closed surface ends where that gets steeper than this.
_FLAP_STEEPEST = 0.45
# The triangles of a closed surface are cut into pieces this small before its upper side is told.
_LONGEST_EDGE_M = 0.004
# Of the box around the tissue, in x and y: a face that covers less of it stands on edge.
_LEAST_COVERED = 0.3


@dataclass(frozen=True)
class Solid:
    """The closed surface of the tissue: ``vertices_m`` (n, 3), ``triangles`` (m, 3) outward."""

    vertices_m: Floats
    triangles: Triangles

    @property
    def volume_m3(self) -> float:
        a, b, c = np.moveaxis(self.vertices_m[self.triangles], 1, 0)
        return float(np.sum(a * np.cross(b, c))) / 6


@dataclass(frozen=True)
class Sheet:
    """The upper face of tissue ``thickness_m`` thick: ``vertices_m`` (n, 3), ``triangles`` (m, 3)
    upward, a height over x and y with one rim."""

    vertices_m: Floats
    triangles: Triangles
    thickness_m: float


def tissue_of(surface: SoundSurface, thickness_m: float | None) -> Solid | Sheet:
    """The tissue that ``surface`` means, the middle of its upper face in the frame's origin.

    A sheet is the upper face of tissue of that thickness; a closed surface is the tissue itself or,
    with a thickness, its upper side is the upper face of such a flap.

    Raises:
        RefusedSurface: a sheet without thickness or that is no height, or tissue on its edge.
    """
    vertices, triangles = surface.vertices_m, surface.triangles
    if thickness_m is None:
        if not surface.closed:
            raise RefusedSurface(
                "the surface is a sheet, open along one rim: say how thick the tissue below it is, "
                "as in --thickness 5mm, or give a closed surface"
            )
        return Solid(_centred(vertices, triangles), triangles)
    if surface.closed:
        vertices, triangles = _upper_side(vertices, triangles)
    _require_height(vertices, triangles)
    return Sheet(_centred(vertices, triangles), triangles, thickness_m)


def _centred(vertices_m: Floats, triangles: Triangles) -> Floats:
    """Moved so that the box around the tissue stands over the origin, with the mean of its upper
    face at z = 0."""
    low, high = vertices_m.min(axis=0), vertices_m.max(axis=0)
    a, b, c = np.moveaxis(vertices_m[triangles], 1, 0)
    upper = sides(vertices_m, triangles) == 1
    shadow = np.cross(b - a, c - a)[upper, 2] / 2
    box = float(np.prod(high[:2] - low[:2]))
    if shadow.sum() < _LEAST_COVERED * box:
        raise RefusedSurface(
            f"seen from above, the tissue's upper face covers only {1e4 * shadow.sum():.1f} of "
            f"{1e4 * box:.1f} cm2: it stands on edge, or winds; say which axis of the file is up, "
            "as in --up y"
        )
    height = np.average((a + b + c)[upper, 2] / 3, weights=shadow)
    return np.asarray(vertices_m - np.array([*(low + high)[:2] / 2, height]))


def _upper_side(vertices_m: Floats, triangles: Triangles) -> tuple[Floats, Triangles]:
    """The largest connected part of a closed surface that faces up."""
    refined, divided = trimesh.remesh.subdivide_to_size(
        vertices_m, triangles, max_edge=_LONGEST_EDGE_M, max_iter=12
    )
    # Halves of one edge are made twice, once for each of its triangles.
    mesh = trimesh.Trimesh(refined, divided, process=False)
    mesh.merge_vertices(digits_vertex=9)
    vertices, divided = np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int64)
    flat_enough = slopes(vertices, divided) > _FLAP_STEEPEST
    kept = divided[(sides(vertices, divided) == 1) & flat_enough]
    if not len(kept):
        raise RefusedSurface("no part of the surface faces up; say which axis is up, as in --up y")
    kept = kept[Topology(kept).bodies() == 0]
    used, packed = np.unique(kept, return_inverse=True)
    return vertices[used], packed.reshape(-1, 3)


def _require_height(vertices_m: Floats, triangles: Triangles) -> None:
    steep = slopes(vertices_m, triangles) <= STEEPEST
    hidden = sides(vertices_m, triangles) != 1
    if steep.any() or hidden.any():
        degrees = np.rad2deg(np.arccos(STEEPEST))
        raise RefusedSurface(
            f"{np.mean(steep | hidden):.0%} of the sheet is steeper than {degrees:.0f} degrees or "
            "lies under another part of it; a sheet should be a height over the plane that --up "
            "names"
        )
