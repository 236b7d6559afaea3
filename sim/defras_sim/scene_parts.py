"""The parts of a scene: tissue, attachments, grasp points, region, arms, cameras, limits.

Fields are bounded where a slip of the unit would otherwise be taken at its word: a pull of 40 m, a
tick of 50 s.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from defras_sim.anatomy.anatomy import Anatomy
from defras_sim.rest_shape import RestShape, Slab

Positive = Annotated[float, Field(gt=0)]
Coordinate = Annotated[float, Field(ge=-5, le=5)]
"""Of something in the operating theatre, in metres from the tissue's centre."""
Vector = tuple[Coordinate, Coordinate, Coordinate]
Side = Annotated[float, Field(gt=0, le=0.5)]
Stroke = Annotated[float, Field(gt=0, le=0.2)]
"""Of an instrument, which reaches some 200 mm beyond its remote centre of motion."""

# A rigid hole is a spring this stiff; the tissue under a hole gives way near 40 N/m.
RIGID_HOLE_N_PER_M = 1e4

MaterialName = Literal["corotational", "neo_hookean", "stable_neo_hookean"]
ElementName = Literal["hexahedron20", "tetrahedron10", "tetrahedron4"]
ArmName = Literal["psm1", "psm2"]


GraspPoint = tuple[int, int]
"""(column, row), both from 1 at the smallest x and y."""


class Part(BaseModel):
    """Base of every part of a scene: unknown keys and NaN are faults, nothing ever changes."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Tissue(Part):
    """The tissue's shape and material, and the finite-element mesh the twin uses for it.

    A slab, unless there is an ``anatomy`` (``defras scene from-mesh``): then length and width are
    those of the box around it, and it has its own meshes of ``tetrahedron10``.

    ``bed``: whether a rigid, frictionless bed lies right under it. Gravity pulls along -z; the
    paper's scenes have none.
    """

    anatomy: Anatomy | None = None
    length_x_m: Side = 0.12
    width_y_m: Side = 0.12
    thickness_m: Side = 0.005
    young_modulus_pa: Annotated[float, Field(gt=0, le=1e7)] = 3000.0
    poisson_ratio: Annotated[float, Field(gt=-1, lt=0.5)] = 0.45
    density_kg_m3: Annotated[float, Field(ge=100, le=5000)] = 1000.0
    gravity_m_s2: Annotated[float, Field(ge=0, le=20)] = 0.0
    material: MaterialName = "neo_hookean"
    element: ElementName = "hexahedron20"
    elements_xyz: tuple[int, int, int] = (8, 8, 1)
    bed: bool = True

    @property
    def shape(self) -> RestShape:
        """The tissue at rest."""
        return self.anatomy or Slab(self.length_x_m, self.width_y_m, self.thickness_m)


class Attachments(Part):
    """Holes of the lower face and which of them hold the tissue.

    ``map`` is drawn as seen from above: first row at largest y, first column at smallest x;
    ``#`` holds, ``.`` is free, a blank is a place without tissue over it. ``stiffness_n_per_m`` is
    how firmly each of them holds; without it they are rigid.
    """

    hole_pitch_m: Positive = 0.01
    hole_radius_m: Annotated[float, Field(gt=0, le=0.05)] = 0.003
    stiffness_n_per_m: Annotated[float, Field(ge=0.1, le=RIGID_HOLE_N_PER_M)] | None = None
    map: tuple[str, ...]


class GraspGrid(Part):
    """Grasp points on the upper face; (column, row) count from 1 at the smallest x and y."""

    columns: Annotated[int, Field(ge=1, le=40)] = 5
    rows: Annotated[int, Field(ge=1, le=40)] = 5
    margin_m: Annotated[float, Field(ge=0)] = 0.01
    patch_radius_m: Annotated[float, Field(ge=0.001, le=0.03)] = 0.005


class Roi(Part):
    """The hidden region of interest: a disc on the bed, just under the tissue's lower face."""

    center_x_m: float
    center_y_m: float
    radius_m: Annotated[float, Field(ge=0.001, le=0.2)] = 0.015


class Arm(Part):
    """A patient-side manipulator: where its remote centre of motion stands, and its side.

    ``force_noise_sd_n``: noise along each axis of a force sensor at the jaw; without it the arm has
    no such sensor. What it says is recorded for diagnosis; the executive never acts on it.
    """

    rcm_m: Vector
    home_tip_m: Vector
    side: Literal["+y", "-y"]
    force_noise_sd_n: Annotated[float, Field(ge=0, le=10)] | None = None


class Camera(Part):
    """A pinhole camera, z up in its picture. ``vertical_fov_rad`` is the full angle."""

    position_m: Vector
    target_m: Vector
    vertical_fov_rad: Annotated[float, Field(ge=0.02, lt=3)] = 0.7
    width_px: Annotated[int, Field(ge=8, le=4096)] = 320
    height_px: Annotated[int, Field(ge=8, le=4096)] = 240
    noise_sd_m: Annotated[float, Field(ge=0, le=0.05)] = 0.0
    period_s: Annotated[float, Field(ge=0.005, le=10)] = 0.1


class Motion(Part):
    """Speeds and lengths of the six actions."""

    reach_speed_m_s: Annotated[float, Field(gt=0, le=0.5)] = 0.05
    tissue_speed_m_s: Annotated[float, Field(gt=0, le=0.2)] = 0.015
    clearance_m: Annotated[float, Field(gt=0, le=0.1)] = 0.03
    pull_height_m: Annotated[float, Field(gt=0, le=0.1)] = 0.04
    move_limit_m: Stroke = 0.03
    fold_distance_m: Stroke = 0.05


class Thresholds(Part):
    """Limits of monitoring, force and goal."""

    delta_m: tuple[Positive, Positive, Positive] = (0.002, 0.004, 0.006)
    force_n: Annotated[float, Field(gt=0, le=50)] | None = None
    roi_visibility: Annotated[float, Field(gt=0, le=1)] = 0.8
    max_age_s: Annotated[float, Field(gt=0, le=10)] = 0.5


class AdoptedEffect(BaseModel):
    """An effect the twin runs with; further keys are its parameters, null where not given."""

    model_config = ConfigDict(extra="allow", frozen=True, allow_inf_nan=False)
    __pydantic_extra__: dict[str, float]
    effect: str

    @property
    def values(self) -> Mapping[str, float]:
        """Parameters by name."""
        return self.__pydantic_extra__


class ModelExtension(Part):
    """How the model differs from the plain one: effects that were found, and adopted."""

    effects: tuple[AdoptedEffect, ...] = ()

    @staticmethod
    def of(extension: Mapping[str, Mapping[str, float]]) -> ModelExtension:
        """The effects of ``extension`` by name, in its order."""
        return ModelExtension(
            effects=tuple(
                AdoptedEffect.model_validate({"effect": name, **values})
                for name, values in extension.items()
            )
        )

    @property
    def extension(self) -> dict[str, Mapping[str, float]]:
        """Parameters of each adopted effect by its name."""
        return {adopted.effect: adopted.values for adopted in self.effects}


class Simulation(Part):
    """How a simulated world imitates the scene when the scene is the actual one."""

    elements_xyz: tuple[int, int, int] = (10, 10, 1)
    bullet_elements_xyz: tuple[int, int, int] = (12, 12, 1)
    bullet_step_s: Annotated[float, Field(gt=0, le=0.01)] = 0.001
    bullet_damping: Annotated[float, Field(gt=0, le=1)] = 0.004


ARMS: dict[ArmName, Arm] = {
    "psm1": Arm(rcm_m=(0.0, 0.09, 0.20), home_tip_m=(-0.02, 0.07, 0.06), side="+y"),
    "psm2": Arm(rcm_m=(0.0, -0.09, 0.20), home_tip_m=(-0.02, -0.07, 0.06), side="-y"),
}
