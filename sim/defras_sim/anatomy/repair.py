"""Mends what can be mended without guessing the anatomy, and refuses the rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray

from defras_sim.anatomy.intersections import first_intersection
from defras_sim.anatomy.refused import RefusedSurface
from defras_sim.anatomy.topology import Topology, length_m
from defras_sim.geometry import Floats

Triangles = NDArray[np.int64]

# Vertices nearer to each other than this share of the surface's size are one.
_SAME = 1e-6
# A hole around which it is less far than this share of the surface's size is closed.
SMALL_HOLE = 0.25


@dataclass(frozen=True)
class SoundSurface:
    """One orientable body without self-intersections: closed, or a sheet with one rim.

    A closed one has its triangles outward, a sheet upward. ``repairs`` says in words what was done.
    """

    vertices_m: Floats
    triangles: Triangles
    closed: bool
    repairs: tuple[str, ...]


def sound_surface(mesh: trimesh.Trimesh) -> SoundSurface:
    """Repair ``mesh`` (in metres).

    Raises:
        RefusedSurface: it is not manifold, not one body, cuts itself, or has a large hole.
    """
    repairs: list[str] = []
    vertices, triangles = _cleaned(np.asarray(mesh.vertices), np.asarray(mesh.faces), repairs)
    topology = Topology(triangles)
    _require_manifold(topology, vertices)
    _require_one_body(topology)
    triangles = _wound(vertices, triangles, repairs)
    vertices, triangles, closed = _small_holes_closed(vertices, triangles, repairs)
    triangles = _faced(vertices, triangles, closed, repairs)
    require_no_intersection(vertices, triangles, "the surface")
    return SoundSurface(vertices, triangles, closed, tuple(repairs))


def require_no_intersection(vertices_m: Floats, triangles: Triangles, what: str) -> None:
    """Raises RefusedSurface where two triangles cut each other."""
    found = first_intersection(vertices_m, triangles)
    if found is not None:
        raise RefusedSurface(
            f"{what} cuts itself near {_place(found)}; every two triangles should meet in a common "
            "edge or corner only"
        )


def _cleaned(
    vertices_m: Floats, triangles: Triangles, repairs: list[str]
) -> tuple[Floats, Triangles]:
    """Without duplicate vertices, empty or repeated triangles, and vertices of none."""
    same_m = _SAME * float(np.ptp(vertices_m, axis=0).max())
    cells = np.round(vertices_m / same_m).astype(np.int64)
    _, first, number = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    merged = number.ravel()[triangles]
    corners = vertices_m[first][merged]
    sides = corners[:, 1:] - corners[:, :1]
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    distinct = (merged[:, 0] != merged[:, 1]) & (merged[:, 1] != merged[:, 2])
    distinct &= (merged[:, 2] != merged[:, 0]) & (area > same_m**2)
    kept = merged[distinct]
    _, once = np.unique(np.sort(kept, axis=1), axis=0, return_index=True)
    kept = kept[np.sort(once)]
    if not len(kept):
        raise RefusedSurface("the surface has no triangle with an area; it may be flat or a line")
    if len(kept) < len(triangles):
        repairs.append(f"left out {len(triangles) - len(kept)} empty or repeated triangles")
    used, packed = np.unique(kept, return_inverse=True)
    if len(used) < len(vertices_m):
        repairs.append(f"merged {len(vertices_m)} vertices into {len(used)}")
    return vertices_m[first][used], packed.reshape(-1, 3)


def _require_manifold(topology: Topology, vertices_m: Floats) -> None:
    crowded = topology.crowded_edges
    if len(crowded):
        raise RefusedSurface(
            f"the surface is not manifold: {len(crowded)} edges belong to more than two triangles, "
            f"one near {_place(vertices_m[crowded[0]].mean(axis=0))}; give the organ's outer "
            "surface alone"
        )
    pinched = topology.pinched_vertices()
    if len(pinched):
        raise RefusedSurface(
            f"the surface is not manifold: parts of it touch in {len(pinched)} single vertices, "
            f"one near {_place(vertices_m[pinched[0]])}; each vertex should have one ring of "
            "triangles around it"
        )


def _require_one_body(topology: Topology) -> None:
    counts = np.bincount(topology.bodies())
    if len(counts) > 1:
        shown = ", ".join(str(count) for count in counts[:4]) + (", ..." if len(counts) > 4 else "")
        raise RefusedSurface(
            f"the surface has {len(counts)} separate bodies (of {shown} triangles); give one organ"
        )


def _wound(vertices_m: Floats, triangles: Triangles, repairs: list[str]) -> Triangles:
    """Neighbouring triangles go round in the same sense."""
    mesh = trimesh.Trimesh(vertices_m, triangles, process=False)
    if not mesh.is_winding_consistent:
        trimesh.repair.fix_winding(mesh)
        if not mesh.is_winding_consistent:
            raise RefusedSurface(
                "the surface has one side only, like a Moebius strip; a tissue has two"
            )
        turned = int(np.sum(np.any(mesh.faces != triangles, axis=1)))
        repairs.append(f"turned {turned} triangles round to agree with their neighbours")
    return np.asarray(mesh.faces, dtype=np.int64)


def _small_holes_closed(
    vertices_m: Floats, triangles: Triangles, repairs: list[str]
) -> tuple[Floats, Triangles, bool]:
    """Holes closed by a fan of triangles around their centre; whether the result is closed."""
    try:
        rims = Topology(triangles).rims()
    except ValueError as error:
        raise RefusedSurface(f"{error}; close the holes before") from error
    limit_m = SMALL_HOLE * float(np.ptp(vertices_m, axis=0).max())
    around_m = [length_m(rim, vertices_m) for rim in rims]
    large = [way_m for way_m in around_m if way_m > limit_m]
    if len(large) > 1:
        ways = " and ".join(f"{1e3 * way_m:.0f} mm" for way_m in sorted(large)[::-1])
        raise RefusedSurface(
            f"the surface has {len(large)} rims, {ways} around; a closed surface has none, a sheet "
            f"one, and only holes of up to {1e3 * limit_m:.0f} mm around are closed"
        )
    small = [rim for rim, way_m in zip(rims, around_m, strict=True) if way_m <= limit_m]
    if small:
        repairs.append(f"closed {len(small)} small hole{'s' if len(small) > 1 else ''}")
    for rim in small:
        centre = len(vertices_m)
        vertices_m = np.concatenate([vertices_m, vertices_m[rim].mean(axis=0)[None]])
        fan = np.stack([np.roll(rim, -1), rim, np.full(len(rim), centre)], axis=1)
        triangles = np.concatenate([triangles, fan])
    return vertices_m, triangles, not large


def _faced(vertices_m: Floats, triangles: Triangles, closed: bool, repairs: list[str]) -> Triangles:
    """A closed surface outwards, a sheet upwards."""
    a, b, c = np.moveaxis(vertices_m[triangles] - vertices_m.mean(axis=0), 1, 0)
    if closed:
        inwards = float(np.sum(a * np.cross(b, c))) < 0
    else:
        inwards = float(np.cross(b - a, c - a)[:, 2].sum()) < 0
    if not inwards:
        return triangles
    repairs.append(f"turned the surface {'inside out' if closed else 'upside down'}")
    return triangles[:, ::-1]


def _place(point_m: Floats) -> str:
    return "({})".format(", ".join(f"{1e3 * value:.1f}" for value in point_m)) + " mm"
