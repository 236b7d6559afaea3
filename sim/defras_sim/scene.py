"""Scene: the YAML description of one patient and set-up, as believed (or as it really is).

Frames: the tissue frame has its origin at the centre of the tissue's rest *upper* surface, z up;
the x-z plane divides the two arms' sides. In simulation it is also the world frame.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from defras_sim.advice import Advice
from defras_sim.effects.effect import Extension
from defras_sim.geometry import Floats
from defras_sim.rest_shape import NotASlab
from defras_sim.scene_faults import scene_faults
from defras_sim.scene_parts import (
    ARMS,
    RIGID_HOLE_N_PER_M,
    AdoptedEffect,
    Arm,
    ArmName,
    Attachments,
    Camera,
    ElementName,
    GraspGrid,
    GraspPoint,
    MaterialName,
    ModelExtension,
    Motion,
    Part,
    Roi,
    Simulation,
    Thresholds,
    Tissue,
    Vector,
)
from defras_sim.yaml_source import InvalidFile, read_extended

__all__ = [
    "RIGID_HOLE_N_PER_M",
    "AdoptedEffect",
    "Arm",
    "ArmName",
    "Attachments",
    "Camera",
    "ElementName",
    "GraspGrid",
    "GraspPoint",
    "MaterialName",
    "ModelExtension",
    "Motion",
    "Part",
    "Roi",
    "Scene",
    "Simulation",
    "Thresholds",
    "Tissue",
    "Vector",
    "load_scene",
]


# Nearer to the plane between the arms' sides than this is on it.
_ON_PLANE_M = 1e-9

# The region of interest lies this far below the tissue.
UNDER_TISSUE_M = 0.001


class Scene(Part):
    """One patient and set-up. Read with :func:`load_scene`."""

    name: str
    description: str = ""
    tick_s: Annotated[float, Field(ge=0.005, le=0.5)] = 0.05
    tissue: Tissue = Tissue()
    attachments: Attachments
    grasp: GraspGrid = GraspGrid()
    roi: Roi
    arms: dict[ArmName, Arm] = Field(default_factory=lambda: dict(ARMS))
    endoscope: Camera = Camera(position_m=(-0.17, 0.0, 0.12), target_m=(0.0, 0.0, 0.0))
    depth_camera: Camera = Camera(
        position_m=(0.17, 0.0, 0.20), target_m=(0.0, 0.0, 0.0), noise_sd_m=0.0005
    )
    motion: Motion = Motion()
    thresholds: Thresholds = Thresholds()
    model: ModelExtension = ModelExtension()
    simulation: Simulation = Simulation()
    advice: tuple[Advice, ...] = ()

    @property
    def hole_counts(self) -> tuple[int, int]:
        """Number of holes along x and y."""
        pitch = self.attachments.hole_pitch_m
        return (
            int(self.tissue.length_x_m / pitch + 1e-9),
            int(self.tissue.width_y_m / pitch + 1e-9),
        )

    @property
    def holes_xy_m(self) -> Floats:
        """Hole centres (n, 2), x fastest, from the smallest x and y."""
        nx, ny = self.hole_counts
        pitch = self.attachments.hole_pitch_m
        x = (np.arange(nx) - (nx - 1) / 2) * pitch
        y = (np.arange(ny) - (ny - 1) / 2) * pitch
        return np.stack([np.tile(x, ny), np.repeat(y, nx)], axis=1)

    @property
    def is_hole(self) -> NDArray[np.bool_]:
        """Which places (n,) of the grid of holes have tissue over them."""
        return self.tissue.shape.covers(self.holes_xy_m)

    @property
    def holes_m(self) -> Floats:
        """Where the holes (n, 3) meet the tissue's lower face."""
        return self.tissue.shape.lower.at(self.holes_xy_m)

    @property
    def attached(self) -> NDArray[np.bool_]:
        """Which holes hold (n,), in the order of :attr:`holes_xy_m`."""
        return _marked(self.attachments.map).copy()

    @property
    def hold_n_per_m(self) -> float:
        """Stiffness of a hole that holds."""
        return self.attachments.stiffness_n_per_m or RIGID_HOLE_N_PER_M

    def hole_stiffness_n_per_m(self, attached: NDArray[np.bool_]) -> Floats:
        """Stiffness of every hole (holes,) if ``attached`` (holes,) were those that hold."""
        return np.where(attached, self.hold_n_per_m, 0.0)

    def grasp_xy_m(self, column: int, row: int) -> Floats:
        """Place (2,) of a grasp point seen from above; column and row count from 1."""
        grid, tissue = self.grasp, self.tissue
        return np.array(
            [
                _spread(column, grid.columns, tissue.length_x_m / 2 - grid.margin_m),
                _spread(row, grid.rows, tissue.width_y_m / 2 - grid.margin_m),
            ]
        )

    def grasp_point_m(self, column: int, row: int) -> Floats:
        """Position (3,) of a grasp point on the tissue's upper face."""
        return self.tissue.shape.upper.at(self.grasp_xy_m(column, row))

    @property
    def grasp_points(self) -> tuple[GraspPoint, ...]:
        """All places of the grid with tissue for a jaw to take, row by row from (1, 1)."""
        grid = self.grasp
        places = [(c, r) for r in range(1, grid.rows + 1) for c in range(1, grid.columns + 1)]
        if self.tissue.anatomy is None:
            return tuple(places)
        room = self.tissue.anatomy.room_m(np.array([self.grasp_xy_m(*place) for place in places]))
        return tuple(
            place for place, m in zip(places, room, strict=True) if m >= grid.patch_radius_m
        )

    def arms_at(self, column: int, row: int) -> tuple[ArmName, ...]:
        """The arms on whose side of the x-z plane a grasp point lies; on the plane, all."""
        y_m = self.grasp_xy_m(column, row)[1]
        return tuple(
            name
            for name, arm in self.arms.items()
            if (y_m if arm.side == "+y" else -y_m) >= -_ON_PLANE_M
        )

    @property
    def roi_center_m(self) -> Floats:
        """Centre (3,) of the region of interest, 1 mm below the tissue's lower face."""
        return self.under_tissue_m(np.array([self.roi.center_x_m, self.roi.center_y_m]))

    def under_tissue_m(self, xy_m: Floats) -> Floats:
        """Points (..., 3) of what lies under the tissue, 1 mm below its lower face at rest."""
        return self.tissue.shape.lower.at(xy_m) - np.array([0.0, 0.0, UNDER_TISSUE_M])

    @property
    def lowest_grasp_m(self) -> float:
        """Height of the lowest grasp point."""
        return min(float(self.grasp_point_m(*point)[2]) for point in self.grasp_points)

    @property
    def simulated(self) -> Scene:
        """The scene with the mesh on which a simulated world imitates it."""
        tissue = self.tissue
        if tissue.anatomy is not None:
            other: dict[str, object] = {"anatomy": tissue.anatomy.taking("actual")}
        else:
            other = {"elements_xyz": self.simulation.elements_xyz}
        return self.model_copy(update={"tissue": tissue.model_copy(update=other)})

    def for_bullet(self) -> Scene:
        """The scene with a twin that shares PyBullet's linear tetrahedra and material.

        The accurate twin differs from PyBullet by several millimetres in a fold, whatever the
        attachments are; that mismatch belongs to diagnosis, not to the retraction.

        Raises:
            NotASlab: the tissue is none.
        """
        if self.tissue.anatomy is not None:
            raise NotASlab(
                f"{self.name}: PyBullet's world simulates slabs only; a patient's anatomy runs in "
                "the model world (--world model)"
            )
        shared = {
            "element": "tetrahedron4",
            "elements_xyz": self.simulation.bullet_elements_xyz,
            "material": "stable_neo_hookean",
        }
        return self.model_copy(update={"tissue": self.tissue.model_copy(update=shared)})

    def with_attached(self, attached: NDArray[np.bool_]) -> Scene:
        """The same scene with another set of holding holes (n,)."""
        nx, ny = self.hole_counts
        marks = np.where(np.asarray(attached), "#", np.where(self.is_hole, ".", " "))
        rows = marks.reshape(ny, nx)[::-1]
        drawn = tuple("".join(row) for row in rows)
        return self.model_copy(
            update={"attachments": self.attachments.model_copy(update={"map": drawn})}
        )

    def extended(self, extension: Extension) -> Scene:
        """The same scene with these effects adopted, and no others."""
        adopted = tuple(
            AdoptedEffect.model_validate({"effect": name, **values})
            for name, values in extension.items()
        )
        return self.model_copy(update={"model": ModelExtension(effects=adopted)})


@lru_cache(maxsize=64)
def _marked(rows: tuple[str, ...]) -> NDArray[np.bool_]:
    """Which marks of a map, from the last row to the first, say that something holds."""
    return np.array([mark == "#" for row in reversed(rows) for mark in row])


def _spread(index: int, count: int, half_m: float) -> float:
    return 0.0 if count == 1 else -half_m + 2 * half_m * (index - 1) / (count - 1)


def load_scene(file: Path) -> Scene:
    """Read a scene file; ``extends: other.yaml`` lays it over another one in the same folder.

    Raises:
        InvalidFile: with every fault as file:line:column.
    """
    source = read_extended(Path(file))
    scene = source.validate(Scene, context={"folder": Path(file).parent})
    faults = [source.fault(place, message) for place, message in scene_faults(scene)]
    if faults:
        raise InvalidFile(faults)
    return scene
