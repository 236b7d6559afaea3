"""The finite-element mesh of a scene's tissue, whatever its shape."""

from __future__ import annotations

from defras_sim.scene import ElementName, Tissue
from defras_sim.tissue.mesh import Mesh, slab_mesh
from defras_sim.tissue.tetrahedral_mesh import tetrahedral_mesh


def tissue_mesh(tissue: Tissue, element: ElementName, elements_xyz: tuple[int, int, int]) -> Mesh:
    """A slab cut into ``elements_xyz``; of a patient's anatomy, the mesh that it takes."""
    if tissue.anatomy is not None:
        return tetrahedral_mesh(tissue.anatomy.volume_mesh)
    return slab_mesh(tissue, element, elements_xyz)
