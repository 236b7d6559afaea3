"""Tetrahedra under a sheet: one layer of prisms, each cut into three.

The force of thin tissue grows with the cube of its thickness, so the thickness is kept exactly,
which a mesher of general solids does not do: it takes faces anywhere within an envelope.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from matplotlib.path import Path as Outline
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from defras_sim.anatomy.anatomy import VolumeMesh
from defras_sim.anatomy.curved_face import CurvedFace
from defras_sim.anatomy.refused import RefusedSurface
from defras_sim.anatomy.solid import Sheet
from defras_sim.anatomy.topology import Topology
from defras_sim.geometry import Floats

Triangles = NDArray[np.int64]

# A rim that turns more than this within one of its corners keeps the corner.
_CORNER_RAD = 0.6
# Of the usual element's; less is a prism that its own bend all but closes.
_LEAST_VOLUME = 0.05
_ROUNDS = 60
_ROUNDS_A_TRIANGULATION = 6
# Of the edge length: how near to the rim points begin, and may come.
_FIRST_FROM_RIM, _NEAREST_TO_RIM = 0.6, 0.45


def sheet_mesh(sheet: Sheet, edge_m: float) -> VolumeMesh:
    """Tetrahedra with edges of about ``edge_m`` along the sheet.

    Raises:
        RefusedSurface: the sheet bends more sharply than its thickness allows.
    """
    upper, triangles = _triangulated(sheet, edge_m)
    lower = upper - sheet.thickness_m * _normals(upper, triangles)
    count = len(upper)
    # The corner with the smallest number goes first: its diagonals agree with the neighbour's.
    first = np.argmin(triangles, axis=1)
    a, b, c = (triangles[np.arange(len(triangles)), (first + k) % 3] for k in range(3))
    d, e, f = a + count, b + count, c + count
    smaller = (b < c)[:, None]
    tetrahedra = np.concatenate(
        [
            np.stack([a, f, e, d], axis=1),
            np.where(smaller, np.stack([a, f, b, e], axis=1), np.stack([a, c, b, e], axis=1)),
            np.where(smaller, np.stack([a, c, b, f], axis=1), np.stack([a, c, e, f], axis=1)),
        ]
    )
    mesh = VolumeMesh(np.concatenate([upper, lower]), tetrahedra)
    corners = mesh.nodes_m[tetrahedra]
    volume = np.linalg.det(corners[:, 1:] - corners[:, :1])
    bad = int(np.argmin(volume))
    if volume[bad] < _LEAST_VOLUME * np.median(volume):
        place = ", ".join(f"{1e3 * x:.0f}" for x in corners[bad].mean(axis=0))
        raise RefusedSurface(
            f"the sheet bends so sharply that {1e3 * sheet.thickness_m:g} mm of tissue below it "
            f"would fold into itself, near ({place}) mm; smooth it, or make the tissue thinner"
        )
    return mesh


def _triangulated(sheet: Sheet, edge_m: float) -> tuple[Floats, Triangles]:
    """The sheet as well-shaped triangles with edges of about ``edge_m`` in space.

    Points repel each other until their distances are even (Persson and Strang, A simple mesh
    generator in MATLAB, SIAM Review 46 (2004), 329-345), those of the rim fixed.
    """
    face = CurvedFace(sheet.vertices_m, sheet.triangles, 1)
    rim = _rim(sheet, edge_m)
    outline = Outline(rim)
    low, high = rim.min(axis=0), rim.max(axis=0)
    inner = _lattice(low, high, edge_m)
    inner = inner[outline.contains_points(inner) & face.covers(inner)]
    inner = inner[face.rim_distance_m(inner) > _FIRST_FROM_RIM * edge_m]
    points, triangles = np.concatenate([rim, inner]), np.zeros((0, 3), dtype=np.int64)
    fixed = len(rim)
    for round_ in range(_ROUNDS):
        if round_ % _ROUNDS_A_TRIANGULATION == 0:
            triangles = _inside(points, outline)
            edges = np.unique(
                np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0
            )
        ahead = face.at(points[edges[:, 0]]) - face.at(points[edges[:, 1]])
        length = np.linalg.norm(ahead, axis=1)
        wanted = 1.2 * np.sqrt(np.mean(length**2))
        push = (np.maximum(wanted - length, 0.0) / length)[:, None] * ahead[:, :2]
        force = np.zeros_like(points)
        np.add.at(force, edges[:, 0], push)
        np.add.at(force, edges[:, 1], -push)
        moved = points[fixed:] + 0.2 * force[fixed:]
        room = face.rim_distance_m(moved)
        stay = (room < _NEAREST_TO_RIM * edge_m) | ~face.covers(moved)
        points[fixed:] = np.where(stay[:, None], points[fixed:], moved)
    triangles = _inside(points, outline)
    rims = Topology(triangles).rims()
    if len(rims) != 1 or len(np.unique(triangles)) < len(points):
        raise RefusedSurface(
            "the sheet's outline is too narrow somewhere for elements of "
            f"{1e3 * edge_m:.0f} mm; cut narrow tongues off"
        )
    return face.at(points), triangles


def _rim(sheet: Sheet, edge_m: float) -> Floats:
    """The rim (k, 2), counter-clockwise, at steps of about ``edge_m``; its corners are kept."""
    loop = Topology(sheet.triangles).rims()[0]
    points = sheet.vertices_m[loop]
    ahead = np.roll(points, -1, axis=0) - points
    length = np.linalg.norm(ahead, axis=1)
    start = np.concatenate([[0.0], np.cumsum(length)])
    heading = np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))
    # The turn over half an edge before and after, so that a finely rounded corner is one, too.
    around = np.concatenate([heading, heading + 2 * np.pi, heading + 4 * np.pi])
    ways = np.concatenate([start[:-1], start[:-1] + start[-1], start[:-1] + 2 * start[-1]])
    middle = start[:-1] + start[-1]
    after = np.interp(middle + 0.25 * edge_m, ways, around)
    turn = np.abs(after - np.interp(middle - 0.25 * edge_m, ways, around))
    # Of the vertices around a corner, the one that turns most is the corner.
    own = np.abs(heading - np.roll(heading, 1) + np.where(np.arange(len(heading)), 0, 2 * np.pi))
    corners = _peaks(turn, own, start[:-1], start[-1], edge_m)
    stops = np.array([*corners, corners[0] + start[-1]]) if len(corners) else start[[0, -1]]
    pieces = []
    for begin, end in pairwise(stops):
        steps = max(1 if len(corners) else 6, round((end - begin) / edge_m))
        pieces.append(np.linspace(begin, end, steps, endpoint=False))
    places = np.concatenate(pieces) % start[-1]
    closed = np.concatenate([points, points[:1]])
    return np.stack([np.interp(places, start, closed[:, k]) for k in range(2)], axis=1)


def _peaks(turn: Floats, own: Floats, at_m: Floats, around_m: float, edge_m: float) -> list[float]:
    """Where the rim turns sharply: the sharpest first, none within an edge of another."""
    chosen: list[float] = []
    for number in np.argsort(-turn - own):
        if turn[number] < _CORNER_RAD:
            continue
        here = at_m[number]
        away = [min(abs(here - other), around_m - abs(here - other)) for other in chosen]
        if min(away, default=np.inf) > edge_m:
            chosen.append(float(here))
    return sorted(chosen)


def _lattice(low: Floats, high: Floats, edge_m: float) -> Floats:
    """Corners (n, 2) of equilateral triangles over a box."""
    row = edge_m * np.sqrt(3) / 2
    rows = np.arange(low[1], high[1] + row, row)
    columns = np.arange(low[0], high[0] + edge_m, edge_m)
    x, y = np.meshgrid(columns, rows)
    x = x + edge_m / 2 * (np.arange(len(rows)) % 2)[:, None]
    return np.stack([x, y], axis=-1).reshape(-1, 2)


def _inside(points: Floats, outline: Outline) -> Triangles:
    """Delaunay's triangles (m, 3) of ``points`` (n, 2) within the outline, counter-clockwise."""
    triangles = Delaunay(points).simplices.astype(np.int64)
    corners = points[triangles]
    sides = corners[:, 1:] - corners[:, :1]
    area = sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]
    triangles[area < 0] = triangles[area < 0][:, ::-1]
    kept = outline.contains_points(corners.mean(axis=1)) & (np.abs(area) > 1e-12)
    return triangles[kept]


def _normals(vertices_m: Floats, triangles: Triangles) -> Floats:
    """Unit normals (n, 3): the area-weighted mean over the triangles around each vertex."""
    a, b, c = np.moveaxis(vertices_m[triangles], 1, 0)
    face = np.cross(b - a, c - a)
    total = np.zeros_like(vertices_m)
    for k in range(3):
        np.add.at(total, triangles[:, k], face)
    return np.asarray(total / np.linalg.norm(total, axis=1, keepdims=True))
