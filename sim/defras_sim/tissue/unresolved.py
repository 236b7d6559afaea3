"""How far tissue gives way under a held disc beyond what the model's mesh can show.

A hole or a jaw of a few millimetres dents the tissue around it. Elements of 10 to 15 mm cannot bend
that sharply; they hold the tissue too firmly there, and the force of a whole retraction comes out
up to 30 % too large however well the rest is resolved (on 12x12x1 elements still 12 %). What is
missing is local. So it is computed once, as the compliance of the disc on a piece of tissue meshed
finely around it less its compliance on the mesh, and put in series with the spring that holds the
disc. Both tissues lie on the same elastic foundation, which confines the difference to the
neighbourhood: it is so stiff that bending dies out within the thickness.

The pull at which a dent hardens comes from pulling a disc of 3 mm radius on small pieces of 5 mm
thickness, fine and coarse, with up to 0.4 N. The corotational material soon draws no deeper, about
0.7 mm on elements of 10 mm and 1.7 mm on such of 15 mm; the neo-Hookean one hardly hardens. The
numbers below are those of 15 mm: on 12x12x1 elements the corotational material then reads up to 5 %
too little.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from defras_sim.anatomy.anatomy import Anatomy
from defras_sim.geometry import Floats
from defras_sim.rest_shape import Face, FlatFace, Slab
from defras_sim.scene import ElementName, MaterialName, Tissue
from defras_sim.tissue.dent import Dent
from defras_sim.tissue.discs import ROWS
from defras_sim.tissue.founded import UNIT_PA, FoundedTissue
from defras_sim.tissue.graded_mesh import graded_breaks, graded_mesh
from defras_sim.tissue.mesh import Mesh, SlabMesh, slab_mesh
from defras_sim.tissue.tetrahedral_mesh import tetrahedral_mesh

# Hardening pull in units of E r^2.
HARDENING: dict[MaterialName, float] = {
    "corotational": 2.0,
    "neo_hookean": 12.0,
    "stable_neo_hookean": 12.0,
}
# The piece of tissue around a disc reaches this many thicknesses far. Beyond half as many an edge
# makes no difference, and smaller differences of its distance than this share of the radius none.
_WINDOW = 6.0
_EDGE_SEEN = 3.0
_EDGE_STEP = 0.1
# On anatomies no two discs are alike: distances of the rim are told apart by this share of the
# radius, thicknesses by this share of themselves.
_RIM_STEP, _THICKNESS_STEP = 0.5, 0.04
# Elements under the disc, in radii; they grow outside this many radii.
_FINEST, _FINEST_DEEP, _CORE, _GROWTH = 0.5, 0.45, 1.2, 2.0


class DentsOf:
    """Dents of discs on the faces of one tissue, as one mesh needs them."""

    def __init__(self, mesh: Mesh, tissue: Tissue, material: MaterialName) -> None:
        self._mesh = mesh
        self._tissue = tissue
        self._material: MaterialName = material

    def at(self, centers_xy_m: Floats, radius_m: float, *, upper: bool) -> Dent:
        """Dents of the rows (3 discs,) of discs around ``centers_xy_m`` (discs, 2).

        Linear tetrahedra have none: they are there to share the faults of PyBullet's.
        """
        tissue, mesh, count = self._tissue, self._mesh, len(centers_xy_m)
        if count == 0 or mesh.element == "tetrahedron4":
            return Dent.none(ROWS * count)
        if isinstance(mesh, SlabMesh):
            give = _missing_on_slab(tissue, mesh, centers_xy_m, radius_m, upper)
        elif tissue.anatomy is not None:
            places = tuple((x, y) for x, y in centers_xy_m.tolist())
            depth = tissue.thickness_m
            give = _missing_on_anatomy(
                tissue.anatomy, depth, tissue.poisson_ratio, places, radius_m, upper
            )
        else:
            raise ValueError(f"a mesh of {type(mesh).__name__} is neither a slab nor an anatomy")
        hardening = HARDENING[self._material] * tissue.young_modulus_pa * radius_m**2
        return Dent(
            give.ravel() * (UNIT_PA / tissue.young_modulus_pa), np.full(ROWS * count, hardening)
        )


def _missing_on_slab(
    tissue: Tissue, mesh: SlabMesh, centers_xy_m: Floats, radius_m: float, upper: bool
) -> Floats:
    """Give (discs, 3) [m/N] that a slab's mesh lacks, at a Young's modulus of 1 Pa."""
    size = (tissue.length_x_m, tissue.width_y_m, tissue.thickness_m)
    # On hexahedra a disc is as good as its mirror image at small x and y; cells cut into
    # tetrahedra have no mirror images.
    distinct = -np.abs(centers_xy_m) if mesh.element == "hexahedron20" else centers_xy_m
    places, which = np.unique(np.round(distinct, 9), axis=0, return_inverse=True)
    give = [
        _missing_give(
            size, mesh.element, mesh.cells_xyz, tissue.poisson_ratio, x, y, radius_m, upper
        )
        for x, y in places.tolist()
    ]
    return np.array(give)[which]


@lru_cache(maxsize=64)
def _missing_on_anatomy(
    anatomy: Anatomy,
    depth_m: float,
    poisson_ratio: float,
    places_xy_m: tuple[tuple[float, float], ...],
    radius_m: float,
    upper: bool,
) -> Floats:
    """Give (discs, 3) [m/N] that an anatomy's mesh lacks, at a Young's modulus of 1 Pa.

    Around a disc of a few millimetres it is taken for flat: a slab as thick as the tissue there,
    that ends in one direction where the face's rim is nearest. A corner gives way further.
    """
    face: Face = anatomy.upper if upper else anatomy.lower
    places = np.array(places_xy_m)
    inside = np.array([face.inset(place, 0.0) for place in places])
    height = anatomy.upper.at(inside)[:, 2] - anatomy.lower.at(inside)[:, 2]
    upright = np.cross(*np.moveaxis(face.tangents(inside), 1, 0))[:, 2]
    steps = np.log(height * np.abs(upright) / depth_m) / _THICKNESS_STEP
    thickness = depth_m * np.exp(_THICKNESS_STEP * np.round(steps))
    rim = (anatomy.upper if upper else anatomy.lower).rim_distance_m(inside)
    step, window, seen = _RIM_STEP * radius_m, _WINDOW * depth_m, _EDGE_SEEN * depth_m
    mesh = _founded_anatomy(anatomy, depth_m, poisson_ratio)
    give = np.zeros((len(places), ROWS))
    for disc, place in enumerate(inside):
        shown = mesh.give(place, radius_m, face)
        edge = step * max(1, round(rim[disc] / step)) if rim[disc] < seen else window
        reach = tuple(round(each, 9) for each in (edge, window, window, window))
        real = _real_give(reach, round(thickness[disc], 9), depth_m, poisson_ratio, radius_m, upper)
        # The nearest rim may lie in any direction: the moments along both axes share.
        real = np.array([real[0], real[1:].mean(), real[1:].mean()])
        give[disc] = np.maximum(real - shown, 0.0)
    give.flags.writeable = False
    return give


@lru_cache(maxsize=4)
def _founded_anatomy(anatomy: Anatomy, depth_m: float, poisson_ratio: float) -> FoundedTissue:
    """The whole anatomy on the model's own mesh."""
    return FoundedTissue(tetrahedral_mesh(anatomy.volume_mesh), depth_m, poisson_ratio)


Size = tuple[float, float, float]


@lru_cache(maxsize=4096)
def _missing_give(
    size_m: Size,
    element: ElementName,
    cells_xyz: tuple[int, int, int],
    poisson_ratio: float,
    x_m: float,
    y_m: float,
    radius_m: float,
    upper: bool,
) -> tuple[float, ...]:
    """Give [m/N] of the three rows of a disc that the mesh lacks, at a Young's modulus of 1 Pa."""
    tissue = Tissue(length_x_m=size_m[0], width_y_m=size_m[1], thickness_m=size_m[2])
    shown = _shown_by(size_m, element, cells_xyz, poisson_ratio).give(
        np.array([x_m, y_m]), radius_m, _face(tissue, upper)
    )
    window, seen = _WINDOW * size_m[2], _EDGE_SEEN * size_m[2]
    step = _EDGE_STEP * radius_m
    edges = (x_m + size_m[0] / 2, size_m[0] / 2 - x_m, y_m + size_m[1] / 2, size_m[1] / 2 - y_m)
    reach = tuple(round(step * round(e / step), 9) if e < seen else window for e in edges)
    real = _real_give(reach, size_m[2], size_m[2], poisson_ratio, radius_m, upper)
    return tuple(np.maximum(real - shown, 0.0).tolist())


@lru_cache(maxsize=256)
def _real_give(
    reach_m: tuple[float, ...],
    thickness_m: float,
    depth_m: float,
    poisson_ratio: float,
    radius_m: float,
    upper: bool,
) -> Floats:
    """Give of a disc on a slab of ``thickness_m``, founded for ``depth_m``, that reaches as far as
    ``reach_m`` to -x, +x, -y, +y."""
    finest, core = _FINEST * radius_m, _CORE * radius_m
    left, right, front, back = reach_m
    top = 0.0 if upper else -thickness_m
    mesh = graded_mesh(
        (
            graded_breaks(-left, right, 0.0, finest, core, _GROWTH),
            graded_breaks(-front, back, 0.0, finest, core, _GROWTH),
            graded_breaks(-thickness_m, 0.0, top, _FINEST_DEEP * radius_m, 0.0, _GROWTH),
        )
    )
    face = _PieceFace(np.full(2, _WINDOW * depth_m), top, reach_m)
    return FoundedTissue(mesh, depth_m, poisson_ratio).give(np.zeros(2), radius_m, face)


@dataclass(frozen=True)
class _PieceFace(FlatFace):
    """The face of a piece of tissue around a disc at its origin, which may reach over its rim.

    ``reach_m``: how far the piece reaches to -x, +x, -y, +y.
    """

    reach_m: tuple[float, ...]

    def at(self, xy_m: Floats) -> Floats:
        left, right, front, back = self.reach_m
        return super().at(np.clip(xy_m, (-left, -front), (right, back)))


@lru_cache(maxsize=16)
def _shown_by(
    size_m: Size, element: ElementName, cells_xyz: tuple[int, int, int], poisson_ratio: float
) -> FoundedTissue:
    """The whole slab on the model's own mesh."""
    tissue = Tissue(length_x_m=size_m[0], width_y_m=size_m[1], thickness_m=size_m[2])
    return FoundedTissue(slab_mesh(tissue, element, cells_xyz), size_m[2], poisson_ratio)


def _face(tissue: Tissue, upper: bool) -> FlatFace:
    slab = Slab(tissue.length_x_m, tissue.width_y_m, tissue.thickness_m)
    return slab.upper if upper else slab.lower
