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

from functools import lru_cache

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.rest_shape import FlatFace, Slab
from defras_sim.scene import ElementName, MaterialName, Tissue
from defras_sim.tissue.assembly import ElasticBody
from defras_sim.tissue.dent import Dent
from defras_sim.tissue.discs import ROWS, disc_rows
from defras_sim.tissue.elements import gauss_hexahedron
from defras_sim.tissue.equilibrium import PotentialEnergy
from defras_sim.tissue.factorisation import SparseCholesky
from defras_sim.tissue.graded_mesh import graded_breaks, graded_mesh
from defras_sim.tissue.material_points import MaterialPoints
from defras_sim.tissue.materials import lame_parameters
from defras_sim.tissue.mesh import Mesh, SlabMesh, slab_mesh
from defras_sim.tissue.terms import BoundaryTerm

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
# Elements under the disc, in radii; they grow outside this many radii.
_FINEST, _FINEST_DEEP, _CORE, _GROWTH = 0.5, 0.45, 1.2, 2.0
_UNIT_PA = 1.0


class DentsOf:
    """Dents of discs on the faces of one tissue, as one mesh needs them."""

    def __init__(self, mesh: Mesh, tissue: Tissue, material: MaterialName) -> None:
        self._mesh = mesh
        self._tissue = tissue
        self._material: MaterialName = material

    def at(self, centers_xy_m: Floats, radius_m: float, *, upper: bool) -> Dent:
        """Dents of the rows (3 discs,) of discs around ``centers_xy_m`` (discs, 2).

        Linear tetrahedra have none: they are there to share the faults of PyBullet's. Nor have
        anatomies, for which no finer model is at hand.
        """
        tissue, mesh, count = self._tissue, self._mesh, len(centers_xy_m)
        if count == 0 or not isinstance(mesh, SlabMesh) or mesh.element == "tetrahedron4":
            return Dent.none(ROWS * count)
        size = (tissue.length_x_m, tissue.width_y_m, tissue.thickness_m)
        # On hexahedra a disc is as good as its mirror image at small x and y; cells cut into
        # tetrahedra have no mirror images.
        mirrored = mesh.element == "hexahedron20"
        distinct = -np.abs(centers_xy_m) if mirrored else centers_xy_m
        places = np.unique(np.round(distinct, 9), axis=0, return_inverse=True)
        give = np.array(
            [
                _missing_give(
                    size, mesh.element, mesh.cells_xyz, tissue.poisson_ratio, x, y, radius_m, upper
                )
                for x, y in places[0].tolist()
            ]
        )[places[1]]
        hardening = HARDENING[self._material] * tissue.young_modulus_pa * radius_m**2
        return Dent(
            give.ravel() * (_UNIT_PA / tissue.young_modulus_pa), np.full(ROWS * count, hardening)
        )


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
    real = _real_give(reach, size_m[2], poisson_ratio, radius_m, upper)
    return tuple(np.maximum(real - shown, 0.0).tolist())


@lru_cache(maxsize=256)
def _real_give(
    reach_m: tuple[float, ...],
    thickness_m: float,
    poisson_ratio: float,
    radius_m: float,
    upper: bool,
) -> Floats:
    """Give of a disc on tissue that reaches as far as ``reach_m`` to -x, +x, -y, +y."""
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
    around = FlatFace(np.full(2, _WINDOW * thickness_m), top)
    return _FoundedTissue(mesh, thickness_m, poisson_ratio).give(np.zeros(2), radius_m, around)


@lru_cache(maxsize=16)
def _shown_by(
    size_m: Size, element: ElementName, cells_xyz: tuple[int, int, int], poisson_ratio: float
) -> _FoundedTissue:
    """The whole slab on the model's own mesh."""
    tissue = Tissue(length_x_m=size_m[0], width_y_m=size_m[1], thickness_m=size_m[2])
    return _FoundedTissue(slab_mesh(tissue, element, cells_xyz), size_m[2], poisson_ratio)


def _face(tissue: Tissue, upper: bool) -> FlatFace:
    slab = Slab(tissue.length_x_m, tissue.width_y_m, tissue.thickness_m)
    return slab.upper if upper else slab.lower


class _FoundedTissue:
    """Linear tissue with a Young's modulus of 1 Pa on an elastic foundation."""

    def __init__(self, mesh: Mesh, thickness_m: float, poisson_ratio: float) -> None:
        self._mesh = mesh
        # All materials are the same to first order.
        body = ElasticBody(mesh, "neo_hookean", *lame_parameters("neo_hookean", 1.0, poisson_ratio))
        foundation = _Foundation(mesh, _UNIT_PA / (10 * thickness_m**2))
        energy = PotentialEnergy(len(mesh.nodes_m), [body, foundation])
        self._cholesky = SparseCholesky(mesh.nodes_m)
        self._cholesky.factorise(energy.tangent(mesh.nodes_m))

    def give(self, center_xy_m: Floats, radius_m: float, face: FlatFace) -> Floats:
        """Motion per force (3,) of a disc's mean and first moments, averaged over x, y and z."""
        rows = disc_rows(self._mesh, center_xy_m[None], radius_m, face).toarray()
        forces = np.kron(rows, np.eye(3)).T
        return np.einsum("ik,ik->k", forces, self._cholesky.solve(forces)).reshape(ROWS, 3).mean(1)


class _Foundation(BoundaryTerm):
    """Holds every bit of tissue where it rests, with ``stiffness`` [N/m per m^3]."""

    name = "foundation"

    def __init__(self, mesh: Mesh, stiffness: float) -> None:
        # On tetrahedra the model's own rule is too coarse for a mass matrix by itself; with the
        # tissue's stiffness added it does.
        rule = gauss_hexahedron(3) if mesh.element == "hexahedron20" else mesh.quadrature
        points = MaterialPoints.of(mesh, rule)
        self._rest_m = mesh.nodes_m
        self.pairs = points.pairs
        mass = np.einsum("eq,qa,qb->eab", points.volumes_m3, points.values, points.values)
        self._each = stiffness * mass.ravel()

    def energy_and_gradient(self, positions_m: Floats) -> tuple[float, Floats]:
        moved = positions_m - self._rest_m
        gradient = np.zeros_like(moved)
        np.add.at(gradient, self.pairs[:, 0], self._each[:, None] * moved[self.pairs[:, 1]])
        return 0.5 * float(np.sum(gradient * moved)), gradient

    def blocks(self, positions_m: Floats) -> Floats:
        return self._each[:, None, None] * np.eye(3)
