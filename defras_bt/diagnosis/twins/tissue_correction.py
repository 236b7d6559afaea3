"""What the twin's mesh gets wrong, known before anything is blamed on the patient.

A mesh fast enough to run beside an operation misses a folded surface by up to a millimetre. That
error hardly changes with small causes, so it is computed for the plain model on a finer mesh, and
put right in every prediction. With large ones it does: it is computed anew for each model that is
accepted, or else weaker causes would be named beside for what it has changed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from defras_bt.diagnosis.twins.tissue_frames import TissueFrames
from defras_bt.diagnosis.twins.tissue_keyframes import Keyframes
from defras_sim.geometry import Floats
from defras_sim.known_way import KnownWay
from defras_sim.scene import Scene
from defras_sim.surface import Surface
from defras_sim.tissue.tissue_mesh import tissue_mesh

_FINER = 2
"""Elements along x and y for each one of the twin's."""


def finer(scene: Scene) -> Scene | None:
    """``scene`` on a finer mesh; None where there is none, as for a patient's anatomy."""
    tissue = scene.tissue
    if tissue.anatomy is not None:
        return None
    nx, ny, nz = tissue.elements_xyz
    elements = {"elements_xyz": (_FINER * nx, _FINER * ny, nz)}
    return scene.model_copy(update={"tissue": tissue.model_copy(update=elements)})


def finer_way(way: KnownWay | None, scene: Scene, fine: Scene) -> KnownWay | None:
    """The ``way`` of the tissue of ``scene``, as the nodes of the ``fine`` one's go."""
    if way is None:
        return None
    coarse_mesh, fine_mesh = (
        tissue_mesh(each.tissue, each.tissue.element, each.tissue.elements_xyz)
        for each in (scene, fine)
    )
    return way.between_nodes(coarse_mesh.interpolation(fine_mesh.nodes_m))


@dataclass(frozen=True)
class MeshCorrection:
    """How much farther surfaces lie (None where not known), and how much larger forces are, on the
    finer mesh: by frame, and by arm (f, 3)."""

    surfaces_m: tuple[Floats | None, ...]
    forces_n: dict[str, Floats]

    @staticmethod
    def none(coarse: TissueFrames) -> MeshCorrection:
        """For a mesh of which there is no finer one."""
        forces = {arm: np.zeros_like(force) for arm, force in coarse.forces_n.items()}
        return MeshCorrection((None,) * len(coarse.surfaces), forces)

    @staticmethod
    def between(coarse: TissueFrames, fine: TissueFrames, at: Keyframes) -> MeshCorrection:
        """From frames on both meshes, of which the fine one was led along the keyframes only: the
        error changes slowly."""
        known = [
            (one.vertices_m, other.vertices_m)
            for one, other in zip(coarse.surfaces, fine.surfaces, strict=True)
            if one is not None and other is not None
        ]
        if not known:
            return MeshCorrection.none(coarse)
        lost = np.full(known[0][0].shape, np.nan)
        surfaces = [
            lost if one is None or other is None else other.vertices_m - one.vertices_m
            for one, other in ((coarse.surfaces[i], fine.surfaces[i]) for i in at.chosen)
        ]
        by_m = at.expanded(np.stack(surfaces, axis=2).reshape(-1, len(surfaces), 1))
        shape = (*lost.shape, len(coarse.surfaces))
        forces = {
            arm: at.expanded((fine.forces_n[arm] - force)[at.chosen].T[:, :, None])[:, :, 0].T
            for arm, force in coarse.forces_n.items()
        }
        return MeshCorrection(tuple(np.moveaxis(by_m.reshape(shape), 2, 0)), forces)

    def applied(self, frames: TissueFrames) -> TissueFrames:
        """``frames`` of any model on the coarse mesh, as far as possible put right."""

        def moved(surface: Surface | None, by_m: Floats | None) -> Surface | None:
            if surface is None or by_m is None:
                return surface
            return replace(surface, vertices_m=surface.vertices_m + by_m)

        return replace(
            frames,
            surfaces=tuple(map(moved, frames.surfaces, self.surfaces_m)),
            forces_n={arm: f + self.forces_n[arm] for arm, f in frames.forces_n.items()},
        )
