"""Volume meshes of a size that can be solved in time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from defras_sim.anatomy.anatomy import VolumeMesh
from defras_sim.anatomy.ftetwild import filled
from defras_sim.anatomy.quality import require_sound, volume_m3
from defras_sim.anatomy.refused import RefusedSurface
from defras_sim.anatomy.sheet_mesh import sheet_mesh
from defras_sim.anatomy.solid import Sheet, Solid
from defras_sim.tissue.tetrahedra import EDGES

_MOST_TRIES = 8
# Below this, a mesh is too coarse to bend as the tissue does.
_FEWEST_UNKNOWNS = 900


def meshed(
    tissue: Solid | Sheet, unknowns: tuple[int, int], tell: Callable[[str], None] | None = None
) -> VolumeMesh:
    """An even mesh whose quadratic elements have between ``unknowns``, or else next below.

    ``tell`` hears about each try.

    Raises:
        RefusedSurface: no sound mesh of that size is found.
    """
    least, most = unknowns
    edge_m, too_long, too_short = _first_guess_m(tissue, (least + most) / 2), np.inf, 0.0
    best: VolumeMesh | None = None
    fault: RefusedSurface | None = None
    for _ in range(_MOST_TRIES):
        try:
            mesh = _with_edges(tissue, edge_m)
        except RefusedSurface as error:  # shorter edges follow the surface better
            fault, too_long = error, min(too_long, edge_m)
            edge_m = _next_m(0.8 * edge_m, too_short, too_long)
            continue
        count = unknowns_of(mesh)
        if tell is not None:
            tell(f"edges of {1e3 * edge_m:.1f} mm give {count} unknowns")
        if count > most:
            too_short = max(too_short, edge_m)
        else:
            too_long = min(too_long, edge_m)
            if best is None or count > unknowns_of(best):
                best = mesh
            if count >= least:
                break
        edge_m = _next_m(edge_m * float(np.sqrt(2 * count / (least + most))), too_short, too_long)
    if best is None and fault is not None:
        raise fault
    if best is None or unknowns_of(best) < _FEWEST_UNKNOWNS:
        raise RefusedSurface(
            f"no mesh of {least} to {most} unknowns, which is what can be solved in time, follows "
            "this tissue; give a smaller part of it, or a smoother or thicker one"
        )
    return best


def unknowns_of(mesh: VolumeMesh) -> int:
    """Of a model with quadratic elements on ``mesh``: three for each corner and edge."""
    edges = np.sort(mesh.tetrahedra[:, EDGES].reshape(-1, 2), axis=1)
    return 3 * (len(mesh.nodes_m) + len(np.unique(edges, axis=0)))


def _with_edges(tissue: Solid | Sheet, edge_m: float) -> VolumeMesh:
    if isinstance(tissue, Sheet):
        mesh = sheet_mesh(tissue, edge_m)
        require_sound(mesh, volume_m3(mesh))
    else:
        mesh = filled(tissue, edge_m)
        require_sound(mesh, tissue.volume_m3)
    return mesh


def _first_guess_m(tissue: Solid | Sheet, unknowns: float) -> float:
    """Edges that give about so many unknowns, by the area of the surface: measured."""
    a, b, c = np.moveaxis(tissue.vertices_m[tissue.triangles], 1, 0)
    area = float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 2
    return float(np.sqrt((47 if isinstance(tissue, Sheet) else 180) * area / unknowns))


def _next_m(guess_m: float, too_short: float, too_long: float) -> float:
    """The guess, if it lies between what was tried; else between them."""
    if 1.02 * too_short < guess_m < 0.98 * too_long:
        return guess_m
    if np.isinf(too_long):
        return 1.25 * too_short
    return float(np.sqrt(max(too_short, 0.5 * too_long) * too_long))
