"""Scene: the YAML description of one patient and set-up, as believed (or as it really is).

Frames: the tissue frame has its origin at the centre of the tissue's rest *upper* surface, z up;
the x-z plane divides the two arms' sides. In simulation it is also the world frame.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from defras_sim.geometry import Floats
from defras_sim.scene_faults import scene_faults
from defras_sim.yaml_source import InvalidFile, read_extended

Vector = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0)]

MaterialName = Literal["corotational", "neo_hookean", "stable_neo_hookean"]
ElementName = Literal["hexahedron20", "tetrahedron10", "tetrahedron4"]

GraspPoint = tuple[int, int]
"""(column, row), both from 1 at the smallest x and y."""

# Nearer to the plane between the arms' sides than this is on it.
_ON_PLANE_M = 1e-9

# A hole that holds is a spring this stiff; the tissue under a hole gives way near 40 N/m.
RIGID_HOLE_N_PER_M = 1e4


def hole_stiffness_n_per_m(attached: NDArray[np.bool_]) -> Floats:
    """Stiffness (holes,) of holes that hold or are free."""
    return np.where(attached, RIGID_HOLE_N_PER_M, 0.0)


class Part(BaseModel):
    """Base of every part of a scene: unknown keys and NaN are faults, nothing ever changes."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Tissue(Part):
    """The slab, its material, and the finite-element mesh the twin uses for it.

    ``bed``: whether a rigid, frictionless bed lies right under it.
    """

    length_x_m: Positive = 0.12
    width_y_m: Positive = 0.12
    thickness_m: Positive = 0.005
    young_modulus_pa: Positive = 3000.0
    poisson_ratio: Annotated[float, Field(gt=-1, lt=0.5)] = 0.45
    material: MaterialName = "neo_hookean"
    element: ElementName = "hexahedron20"
    elements_xyz: tuple[int, int, int] = (8, 8, 1)
    bed: bool = True


class Attachments(Part):
    """Holes of the lower face and which of them hold the tissue.

    ``map`` is drawn as seen from above: first row at largest y, first column at smallest x;
    ``#`` holds, ``.`` is free.
    """

    hole_pitch_m: Positive = 0.01
    hole_radius_m: Positive = 0.003
    map: tuple[str, ...]


class GraspGrid(Part):
    """Grasp points on the upper face; (column, row) count from 1 at the smallest x and y."""

    columns: Annotated[int, Field(ge=1, le=40)] = 5
    rows: Annotated[int, Field(ge=1, le=40)] = 5
    margin_m: Annotated[float, Field(ge=0)] = 0.01
    patch_radius_m: Positive = 0.005


class Roi(Part):
    """The hidden region of interest: a disc on the bed, just under the tissue's lower face."""

    center_x_m: float
    center_y_m: float
    radius_m: Positive = 0.015


class Arm(Part):
    """A patient-side manipulator: where its remote centre of motion stands, and its side."""

    rcm_m: Vector
    home_tip_m: Vector
    side: Literal["+y", "-y"]


class Camera(Part):
    """A pinhole camera, z up in its picture. ``vertical_fov_rad`` is the full angle."""

    position_m: Vector
    target_m: Vector
    vertical_fov_rad: Annotated[float, Field(gt=0, lt=3)] = 0.7
    width_px: Annotated[int, Field(ge=8)] = 320
    height_px: Annotated[int, Field(ge=8)] = 240
    noise_sd_m: Annotated[float, Field(ge=0)] = 0.0
    period_s: Positive = 0.1


class Motion(Part):
    """Speeds and lengths of the six actions."""

    reach_speed_m_s: Positive = 0.05
    tissue_speed_m_s: Positive = 0.015
    clearance_m: Positive = 0.03
    pull_height_m: Positive = 0.04
    move_limit_m: Positive = 0.03
    fold_distance_m: Positive = 0.05


class Thresholds(Part):
    """Limits of monitoring, force and goal."""

    delta_m: tuple[Positive, Positive, Positive] = (0.002, 0.004, 0.006)
    force_n: Positive | None = None
    roi_visibility: Annotated[float, Field(gt=0, le=1)] = 0.8
    max_age_s: Positive = 0.5


class AdoptedEffect(BaseModel):
    """An effect the twin runs with; further keys are its parameters."""

    model_config = ConfigDict(extra="allow", frozen=True)
    effect: str


class ModelExtension(Part):
    effects: tuple[AdoptedEffect, ...] = ()


class Simulation(Part):
    """How a simulated world imitates the scene when the scene is the actual one."""

    elements_xyz: tuple[int, int, int] = (10, 10, 1)
    bullet_elements_xyz: tuple[int, int, int] = (12, 12, 1)
    bullet_step_s: Positive = 0.001
    bullet_damping: Positive = 0.004


ArmName = Literal["psm1", "psm2"]

_ARMS: dict[ArmName, Arm] = {
    "psm1": Arm(rcm_m=(0.0, 0.09, 0.20), home_tip_m=(-0.02, 0.07, 0.06), side="+y"),
    "psm2": Arm(rcm_m=(0.0, -0.09, 0.20), home_tip_m=(-0.02, -0.07, 0.06), side="-y"),
}


class Scene(Part):
    """One patient and set-up. Read with :func:`load_scene`."""

    name: str
    description: str = ""
    tick_s: Positive = 0.05
    tissue: Tissue = Tissue()
    attachments: Attachments
    grasp: GraspGrid = GraspGrid()
    roi: Roi
    arms: dict[ArmName, Arm] = Field(default_factory=lambda: dict(_ARMS))
    endoscope: Camera = Camera(position_m=(-0.17, 0.0, 0.12), target_m=(0.0, 0.0, 0.0))
    depth_camera: Camera = Camera(
        position_m=(0.17, 0.0, 0.20), target_m=(0.0, 0.0, 0.0), noise_sd_m=0.0005
    )
    motion: Motion = Motion()
    thresholds: Thresholds = Thresholds()
    model: ModelExtension = ModelExtension()
    simulation: Simulation = Simulation()

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
    def attached(self) -> NDArray[np.bool_]:
        """Which holes hold (n,), in the order of :attr:`holes_xy_m`."""
        return np.array([mark == "#" for row in reversed(self.attachments.map) for mark in row])

    def grasp_xy_m(self, column: int, row: int) -> Floats:
        """Position (2,) of a grasp point; column and row count from 1."""
        grid, tissue = self.grasp, self.tissue
        return np.array(
            [
                _spread(column, grid.columns, tissue.length_x_m / 2 - grid.margin_m),
                _spread(row, grid.rows, tissue.width_y_m / 2 - grid.margin_m),
            ]
        )

    @property
    def grasp_points(self) -> tuple[GraspPoint, ...]:
        """All grasp points, row by row from (1, 1)."""
        grid = self.grasp
        return tuple((c, r) for r in range(1, grid.rows + 1) for c in range(1, grid.columns + 1))

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
        return np.array(
            [self.roi.center_x_m, self.roi.center_y_m, -self.tissue.thickness_m - 0.001]
        )

    def for_bullet(self) -> Scene:
        """The scene with a twin that shares PyBullet's linear tetrahedra and material.

        The accurate twin differs from PyBullet by several millimetres in a fold, whatever the
        attachments are; that mismatch belongs to diagnosis, not to the retraction.
        """
        shared = {
            "element": "tetrahedron4",
            "elements_xyz": self.simulation.bullet_elements_xyz,
            "material": "stable_neo_hookean",
        }
        return self.model_copy(update={"tissue": self.tissue.model_copy(update=shared)})

    def with_attached(self, attached: NDArray[np.bool_]) -> Scene:
        """The same scene with another set of holding holes (n,)."""
        nx, ny = self.hole_counts
        rows = np.where(np.asarray(attached).reshape(ny, nx)[::-1], "#", ".")
        drawn = tuple("".join(row) for row in rows)
        return self.model_copy(
            update={"attachments": self.attachments.model_copy(update={"map": drawn})}
        )


def _spread(index: int, count: int, half_m: float) -> float:
    return 0.0 if count == 1 else -half_m + 2 * half_m * (index - 1) / (count - 1)


def load_scene(file: Path) -> Scene:
    """Read a scene file; ``extends: other.yaml`` lays it over another one in the same folder.

    Raises:
        InvalidFile: with every fault as file:line:column.
    """
    source = read_extended(Path(file))
    scene = source.validate(Scene)
    faults = [source.fault(place, message) for place, message in scene_faults(scene)]
    if faults:
        raise InvalidFile(faults)
    return scene
