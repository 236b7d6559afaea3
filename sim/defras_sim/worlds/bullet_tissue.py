"""The tissue as a PyBullet deformable: attachments and grips as anchors of its nodes."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Scene
from defras_sim.surface import Surface
from defras_sim.tissue.grasp import nodes_under_jaw
from defras_sim.tissue.materials import lame_parameters
from defras_sim.tissue.mesh import slab_mesh
from defras_sim.tissue.surface import surface_map
from defras_sim.worlds.colours import TISSUE

CONTACT_MARGIN_M = 0.001
_ROUNDING_M = 1e-6


class BulletTissue:
    """Linear tetrahedra with PyBullet's neo-Hookean law."""

    def __init__(self, client: Any, scene: Scene) -> None:
        """``client``: a pybullet client in deformable mode."""
        self._client = client
        mesh = slab_mesh(scene.tissue, "tetrahedron4", scene.simulation.bullet_elements_xyz)
        self._rest_m = mesh.nodes_m
        self._surface = surface_map(mesh, scene.tissue)
        self._mesh = mesh
        self._jaw_radius_m = scene.grasp.patch_radius_m
        self._thickness_m = scene.tissue.thickness_m
        self.body = self._load(scene, mesh.connectivity)
        for node in self._held_nodes(scene):
            client.createSoftBodyAnchor(self.body, int(node), -1, -1)

    def nodes_m(self) -> Floats:
        """Positions (n, 3) of the nodes, tissue frame."""
        _, nodes = self._client.getMeshData(
            self.body, -1, flags=self._client.MESH_DATA_SIMULATION_MESH
        )
        return np.array(nodes)

    def surface(self) -> Surface:
        return self._surface.surface(self.nodes_m())

    def grip(self, body: int, tissue_from_body: Pose, nodes: NDArray[np.int64]) -> list[int]:
        """Anchor ``nodes`` to a rigid body where they are; returns the anchors."""
        offsets_m = tissue_from_body.inverse().apply(self.nodes_m()[nodes])
        return [
            self._client.createSoftBodyAnchor(self.body, int(node), body, -1, list(offset))
            for node, offset in zip(nodes, offsets_m, strict=True)
        ]

    def let_go(self, anchors: list[int]) -> None:
        for anchor in anchors:
            self._client.removeConstraint(anchor)

    def patch_at(self, point_m: Floats) -> NDArray[np.int64]:
        """Nodes that a jaw at ``point_m`` (3,) takes: those the twin holds on the same mesh."""
        surface = self.surface()
        upper = np.flatnonzero(surface.upper)
        nearest = upper[np.argmin(np.linalg.norm(surface.vertices_m[upper] - point_m, axis=1))]
        return nodes_under_jaw(self._mesh, surface.rest_xy_m[nearest], self._jaw_radius_m)

    def _held_nodes(self, scene: Scene) -> NDArray[np.int64]:
        """Nodes of the lower face at the corners of each holding hole's cell."""
        lower = self._rest_m[:, 2] < -self._thickness_m + _ROUNDING_M
        half_m = scene.attachments.hole_pitch_m / 2 + _ROUNDING_M
        near = np.zeros(len(self._rest_m), bool)
        for hole_m in scene.holes_xy_m[scene.attached]:
            near |= np.all(np.abs(self._rest_m[:, :2] - hole_m) <= half_m, axis=1)
        return np.flatnonzero(lower & near)

    def _load(self, scene: Scene, tetrahedra: NDArray[np.int64]) -> int:
        tissue = scene.tissue
        mu, lam = lame_parameters(
            "stable_neo_hookean", tissue.young_modulus_pa, tissue.poisson_ratio
        )
        volume_m3 = tissue.length_x_m * tissue.width_y_m * tissue.thickness_m
        with tempfile.TemporaryDirectory() as folder:
            # Without a texture of its own a soft body wears PyBullet's checkerboard.
            plain = Path(folder) / "plain.png"
            Image.new("RGB", (4, 4), "white").save(plain)
            texture = self._client.loadTexture(str(plain))
            file = Path(folder) / "slab.vtk"
            _write_vtk(file, self._rest_m, tetrahedra)
            body = self._client.loadSoftBody(
                str(file),
                mass=tissue.density_kg_m3 * volume_m3,
                useNeoHookean=1,
                NeoHookeanMu=mu,
                NeoHookeanLambda=lam,
                NeoHookeanDamping=scene.simulation.bullet_damping,
                useSelfCollision=0,
                collisionMargin=CONTACT_MARGIN_M,
            )
        flags = self._client.VISUAL_SHAPE_DOUBLE_SIDED
        self._client.changeVisualShape(
            body, -1, rgbaColor=[*TISSUE, 1], flags=flags, textureUniqueId=texture
        )
        return int(body)


def _write_vtk(file: Path, nodes_m: Floats, tetrahedra: NDArray[np.int64]) -> None:
    """Legacy VTK, the only volume format PyBullet reads."""
    lines = ["# vtk DataFile Version 2.0", "slab", "ASCII", "DATASET UNSTRUCTURED_GRID"]
    lines.append(f"POINTS {len(nodes_m)} double")
    lines += ["{:.9g} {:.9g} {:.9g}".format(*node) for node in nodes_m]
    lines.append(f"CELLS {len(tetrahedra)} {5 * len(tetrahedra)}")
    lines += ["4 {} {} {} {}".format(*corners) for corners in tetrahedra]
    lines.append(f"CELL_TYPES {len(tetrahedra)}")
    lines += ["10"] * len(tetrahedra)
    file.write_text("\n".join(lines) + "\n", encoding="ascii")
