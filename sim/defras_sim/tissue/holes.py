"""The holes of the lower face: where they hold the tissue, and how firmly."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.tissue.dent import Dent
from defras_sim.tissue.discs import ROWS, disc_rows
from defras_sim.tissue.mesh import Mesh
from defras_sim.tissue.springs import Springs, SpringTerm
from defras_sim.tissue.unresolved import DentsOf

TERM_NAME = "attachments"


class Holes:
    """All holes of a scene on a mesh, in the order of ``scene.holes_xy_m``.

    ``targets_m`` (3 holes, 3) is what their springs hold the tissue at: its shape at rest, which is
    the mesh's own unless :meth:`anchor_at` says otherwise.
    """

    def __init__(self, mesh: Mesh, scene: Scene, dents: DentsOf) -> None:
        self._is_hole = scene.is_hole
        rows = disc_rows(
            mesh,
            scene.holes_xy_m[self._is_hole],
            scene.attachments.hole_radius_m,
            scene.tissue.shape.lower,
        )
        self._dent = Dent.none(ROWS * len(self._is_hole)).with_some(
            np.repeat(self._is_hole, ROWS),
            dents.at(scene.holes_xy_m[self._is_hole], scene.attachments.hole_radius_m, upper=False),
        )
        # Places of the grid without tissue hold nothing: their rows are empty.
        places = sparse.eye_array(ROWS * len(self._is_hole), format="csc")
        self._rows = sparse.csr_array(places[:, np.repeat(self._is_hole, ROWS)] @ rows)
        self.targets_m: Floats = self._rows @ mesh.nodes_m
        self._springs = self._with_stiffness(scene.hole_stiffness_n_per_m(scene.attached))
        self._height_m = 0.0

    def anchor_at(self, positions_m: Floats) -> None:
        """Hold the tissue from now on where it is when its nodes lie at ``positions_m``."""
        self.targets_m = self._rows @ positions_m

    @property
    def stiffness_n_per_m(self) -> Floats:
        """Stiffness of every hole (holes,); zero is free."""
        return self._springs.stiffness_n_per_m[::ROWS].copy()

    @stiffness_n_per_m.setter
    def stiffness_n_per_m(self, stiffness_n_per_m: Floats) -> None:
        stiffness = np.array(stiffness_n_per_m, dtype=float)
        holes = self._rows.shape[0] // ROWS
        if stiffness.shape != (holes,):
            raise ValueError(
                f"hole stiffness has shape {stiffness.shape}; the scene has {holes} holes"
            )
        if not np.all(np.isfinite(stiffness) & (stiffness >= 0)):
            raise ValueError("hole stiffness should be finite and at least 0 N/m")
        if np.any(stiffness[~self._is_hole] > 0):
            raise ValueError("a hole without tissue over it cannot hold; its stiffness should be 0")
        self._springs = self._with_stiffness(stiffness)

    @property
    def height_m(self) -> float:
        """How much higher than modelled the holes are."""
        return self._height_m

    @height_m.setter
    def height_m(self, height_m: float) -> None:
        if not np.isfinite(height_m):
            raise ValueError(f"the height of the holes should be finite, is {height_m} m")
        self._height_m = height_m

    @property
    def term(self) -> SpringTerm:
        """The boundary term by which the holes hold the tissue."""
        targets = self.targets_m
        if self._height_m != 0.0:
            # Only the means move with a translation, the moments do not.
            targets = targets.copy()
            targets[::ROWS, 2] += self._height_m
        return SpringTerm(TERM_NAME, self._springs, targets)

    def _with_stiffness(self, stiffness_n_per_m: Floats) -> Springs:
        return Springs(self._rows, np.repeat(stiffness_n_per_m, ROWS), self._dent)
