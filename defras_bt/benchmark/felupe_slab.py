"""The slab in felupe: another code's elements, assembly, material and solver.

Only what holds the tissue follows this project's definition, because it is part of the question:
discs held by their mean and first moments with rigid springs, interpolated by felupe's elements.
felupe comes with the extra ``[test]``.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, Literal

import felupe
import numpy as np
from scipy import sparse

from defras_sim.geometry import Floats
from defras_sim.scene import RIGID_HOLE_N_PER_M, MaterialName, Scene
from defras_sim.tissue.discs import DISC_MOMENTS, DISC_POINTS
from defras_sim.tissue.materials import lame_parameters
from defras_sim.tissue.mesh import Integers

FelupeElement = Literal["hexahedron20", "hexahedron27"]


class FelupeSlab:
    """A scene's slab, grasped at ``grasp_xy_m`` of its upper face."""

    def __init__(
        self,
        scene: Scene,
        material: MaterialName,
        element: FelupeElement,
        cells_xyz: tuple[int, int, int],
        grasp_xy_m: Floats,
    ) -> None:
        tissue = scene.tissue
        half = np.array([tissue.length_x_m, tissue.width_y_m]) / 2
        corner = np.array([*-half, -tissue.thickness_m])
        self._cells = np.array(cells_xyz)
        self._corner_m = corner
        self._cell_m = np.array([*2 * half, tissue.thickness_m]) / self._cells
        mesh = felupe.Cube(
            a=tuple(corner), b=(*half, 0.0), n=tuple(int(c) + 1 for c in cells_xyz)
        ).add_midpoints_edges()
        if element == "hexahedron27":
            mesh = mesh.add_midpoints_faces().add_midpoints_volumes()
            region: Any = felupe.RegionTriQuadraticHexahedron(mesh)
        else:
            region = felupe.RegionQuadraticHexahedron(mesh)
        self._element = region.element
        self.nodes_m: Floats = region.mesh.points
        self._connectivity: Integers = region.mesh.cells
        self._of_cell = self._numbered()
        self.field = felupe.FieldContainer([felupe.Field(region, dim=3)])
        self.solid = felupe.SolidBody(felupe_material(material, scene), self.field)
        holes = self._disc_rows(
            scene.holes_xy_m[scene.attached], scene.attachments.hole_radius_m, corner[2]
        )
        grasp = self._disc_rows(np.asarray(grasp_xy_m)[None], scene.grasp.patch_radius_m, 0.0)
        self.held = HeldDiscs(self.field, sparse.csr_array(sparse.vstack([holes, grasp])))

    def move_tip_to(self, moved_m: Floats) -> None:
        """Hold the grasped disc ``moved_m`` (3,) away from where it rests."""
        self.held.grasp_moved_m = moved_m

    @property
    def positions_m(self) -> Floats:
        """Where the nodes lie (nodes, 3)."""
        return self.nodes_m + self.field[0].values

    def place(self, positions_m: Floats) -> None:
        self.field[0].values[:] = positions_m - self.nodes_m

    def grasp_force_n(self) -> Floats:
        """Force (3,) that the jaw exerts on the tissue."""
        return self.held.forces_n()[-3]

    def residual_n(self) -> Floats:
        """Unbalanced nodal forces (3 nodes,)."""
        items = (self.solid, self.held)
        return sum(item.assemble.vector(self.field).toarray()[:, 0] for item in items)

    def tangent(self) -> sparse.csr_matrix:
        """Derivative (3 nodes, 3 nodes) [N/m] of the unbalanced forces by the positions."""
        return self.solid.assemble.matrix(self.field) + self.held.assemble.matrix(self.field)

    def solve(self, tolerance: float = 1e-8, solver: Any = None) -> int:
        """felupe's own Newton method; its iterations.

        Raises:
            ValueError: it does not converge.
        """
        extra = {} if solver is None else {"solver": solver}
        result = felupe.newtonraphson(
            self.field,
            items=[self.solid, self.held],
            dof0=np.array([], dtype=int),
            dof1=np.arange(self.nodes_m.size),
            ext0=np.array([]),
            tol=tolerance,
            verbose=0,
            **extra,
        )
        return int(result.iterations)

    def interpolation(self, points_m: Floats) -> sparse.csr_array:
        """Matrix (points, nodes) that interpolates nodal values at rest points (points, 3)."""
        scaled = (np.asarray(points_m) - self._corner_m) / self._cell_m
        cell = np.clip(np.floor(scaled + 1e-12).astype(int), 0, self._cells - 1)
        local = 2 * (scaled - cell) - 1
        columns = self._connectivity[self._of_cell[tuple(cell.T)]]
        values = np.array([self._element.function(point) for point in local])
        rows = np.repeat(np.arange(len(local)), values.shape[1])
        shape = (len(local), len(self.nodes_m))
        return sparse.csr_array((values.ravel(), (rows, columns.ravel())), shape=shape)

    def _numbered(self) -> Integers:
        """Number of the element in each cell (nx, ny, nz)."""
        middles = self.nodes_m[self._connectivity[:, :8]].mean(axis=1)
        cell = np.floor((middles - self._corner_m) / self._cell_m).astype(int)
        numbers = np.empty(tuple(self._cells), dtype=np.int64)
        numbers[tuple(cell.T)] = np.arange(len(middles))
        return numbers

    def _disc_rows(self, centers_m: Floats, radius_m: float, height_m: float) -> sparse.csr_array:
        flat = centers_m[:, None] + radius_m * DISC_POINTS
        points = np.concatenate([flat, np.full((*flat.shape[:2], 1), height_m)], axis=2)
        moments = sparse.kron(sparse.eye_array(len(centers_m)), DISC_MOMENTS, format="csr")
        return sparse.csr_array(moments @ self.interpolation(points.reshape(-1, 3)))


class HeldDiscs:
    """Rigid springs on discs, as felupe takes them; the last three rows are the grasp's."""

    def __init__(self, field: Any, rows: sparse.csr_array) -> None:
        self.field = field
        self.grasp_moved_m: Floats = np.zeros(3)
        self._rows = rows
        self._stiffness = RIGID_HOLE_N_PER_M * sparse.csr_matrix(
            sparse.kron(rows.T @ rows, sparse.eye_array(3))
        )
        self.results = SimpleNamespace(update_statevars=lambda: None)  # springs have no memory
        self.assemble = SimpleNamespace(vector=self._vector, matrix=self._matrix, multiplier=None)

    def forces_n(self) -> Floats:
        """Force (rows, 3) on each held quantity."""
        stretch = -(self._rows @ self.field[0].values)
        stretch[-3] += self.grasp_moved_m
        return RIGID_HOLE_N_PER_M * stretch

    def _vector(self, field: Any = None, parallel: bool = False) -> sparse.csr_matrix:
        gradient = -(self._rows.T @ self.forces_n())
        return sparse.csr_matrix(gradient.reshape(-1, 1))

    def _matrix(self, field: Any = None, parallel: bool = False) -> sparse.csr_matrix:
        return self._stiffness.copy()


def felupe_material(material: MaterialName, scene: Scene) -> Any:
    """felupe's neo-Hookean law, or the corotational one written for felupe."""
    tissue = scene.tissue
    mu, lam = lame_parameters(material, tissue.young_modulus_pa, tissue.poisson_ratio)
    if material == "neo_hookean":
        return felupe.NeoHookeCompressible(mu=mu, lmbda=lam)
    if material == "corotational":
        return felupe.Material(_corotational_stress, _corotational_tangent, mu=mu, lam=lam)
    raise ValueError(f"{material} is not compared with felupe; valid: neo_hookean, corotational")


def _polar(F: Floats) -> tuple[Floats, Floats, Floats]:
    """F (3, 3, points, elements) = U diag(s) V^T with det U V^T = 1, by singular values."""
    U, s, Vt = np.linalg.svd(np.moveaxis(F, (0, 1), (-2, -1)))
    mirrored = np.where(np.linalg.det(U @ Vt) < 0, -1.0, 1.0)
    U[..., :, 2] *= mirrored[..., None]
    s[..., 2] *= mirrored
    return U, s, Vt


def _corotational_stress(x: list[Any], mu: float, lam: float) -> list[Any]:
    """P = 2 mu (F - R) + lambda tr(S - I) R."""
    F = x[0]
    U, s, Vt = _polar(F)
    R = np.moveaxis(U @ Vt, (-2, -1), (0, 1))
    return [2 * mu * (F - R) + lam * (s.sum(axis=-1) - 3) * R, x[1]]


def _corotational_tangent(x: list[Any], mu: float, lam: float) -> list[Any]:
    """2 mu I + lambda R (x) R + (lambda tr(S - I) - 2 mu) dR/dF.

    In the axes of U and V a change dF turns R by (dF_ij - dF_ji) / (s_i + s_j).
    """
    U, s, Vt = _polar(x[0])
    R = U @ Vt
    factor = lam * (s.sum(axis=-1) - 3) - 2 * mu
    sums = s[..., :, None] + s[..., None, :]
    turns = (1 - np.eye(3)) / np.where(np.abs(sums) < 1e-9, 1e-9, sums) * factor[..., None, None]
    V = np.swapaxes(Vt, -1, -2)
    A = np.einsum("...ai,...ij,...bj,...ci,...dj->abcd...", U, turns, V, U, V, optimize=True)
    A -= np.einsum("...ai,...ij,...bj,...cj,...di->abcd...", U, turns, V, U, V, optimize=True)
    A += lam * np.einsum("...ab,...cd->abcd...", R, R)
    identity = np.eye(3)
    A += 2 * mu * np.einsum("ac,bd->abcd", identity, identity)[..., None, None]
    return [A]
