"""A scene around a patient's anatomy: a first belief, to be edited."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from defras_sim.anatomy.anatomy import Anatomy
from defras_sim.anatomy.refused import RefusedSurface
from defras_sim.camera.ray_caster import RayCaster
from defras_sim.camera.visibility import roi_visibility
from defras_sim.scene import Arm, ArmName, Attachments, Camera, Roi, Scene, Tissue
from defras_sim.scene_parts import ARMS
from defras_sim.tissue.model import TissueModel

Edge = Literal["far", "near", "left", "right"]
"""Of the tissue, as the endoscope sees it, which looks along x."""

# Holes that hold, counted inwards from the rim.
_ROWS_HELD = 2
# Of the tissue's size across, the part along which it is held.
_PART_HELD = 0.7
# What the default set-up is made for.
_USUAL_SIZE_M = 0.12
_INWARDS: dict[Edge, tuple[float, float]] = {
    "far": (-1, 0), "near": (1, 0), "left": (0, -1), "right": (0, 1)
}  # fmt: skip


def believed_scene(
    anatomy: Anatomy, *, name: str, description: str, thickness_m: float | None, held: Edge
) -> Scene:
    """Tissue held along one edge over a hidden region, arms and cameras placed by its size.

    Raises:
        RefusedSurface: the tissue has no room for holes, grasp points or a hidden region.
    """
    size_m = anatomy.high_m - anatomy.low_m
    tissue = Tissue(
        anatomy=anatomy,
        length_x_m=round(float(size_m[0]), 4),
        width_y_m=round(float(size_m[1]), 4),
        thickness_m=round(float(size_m[2] if thickness_m is None else thickness_m), 4),
        element="tetrahedron10",
    )
    frame = _set_up(tissue, name, description)
    attached = _edge_holes(frame, held)
    if not attached.any() or not frame.grasp_points:
        raise RefusedSurface(
            f"the tissue, {1e3 * size_m[0]:.0f} x {1e3 * size_m[1]:.0f} mm seen from above, has no "
            "room for holes or grasp points; is the unit right?"
        )
    return _over_hidden_region(frame.with_attached(attached), anatomy)


def require_rest(scene: Scene) -> None:
    """Both meshes have to carry the surface, the holes and the bed, and to lie still on it.

    Raises:
        RefusedSurface: one of them does not.
    """
    for mesh, each in (("twin", scene), ("actual", scene.simulated)):
        try:
            rests = TissueModel(each).solve({}).converged
        except ValueError as error:
            raise RefusedSurface(
                f"the mesh of the {mesh} tissue cannot be used: {error}"
            ) from error
        if not rests:
            raise RefusedSurface(f"the {mesh} tissue does not lie still on its bed")


def _set_up(tissue: Tissue, name: str, description: str) -> Scene:
    """Arms and cameras around the tissue, as far away as its size asks for; nothing holds."""
    scale = max(1.0, max(tissue.length_x_m, tissue.width_y_m) / _USUAL_SIZE_M)
    top_m = round(float(tissue.shape.high_m[2]), 4)

    def placed(position_m: tuple[float, float, float]) -> tuple[float, float, float]:
        x, y, z = position_m
        return round(scale * x, 4), round(scale * y, 4), round(scale * z + top_m, 4)

    def aside(position_m: tuple[float, float, float]) -> tuple[float, float, float]:
        # Instruments do not grow with the tissue: arms move apart and up, no farther away.
        x, y, z = position_m
        return x, round(scale * y, 4), round(z + top_m, 4)

    arms: dict[ArmName, Arm] = {
        arm: part.model_copy(
            update={"rcm_m": aside(part.rcm_m), "home_tip_m": aside(part.home_tip_m)}
        )
        for arm, part in ARMS.items()
    }
    usual = Scene(
        name=name, attachments=Attachments(map=("#",)), roi=Roi(center_x_m=0, center_y_m=0)
    )

    def moved(camera: Camera) -> Camera:
        return camera.model_copy(update={"position_m": placed(camera.position_m)})

    return usual.model_copy(
        update={
            "description": description,
            "tissue": tissue,
            "arms": arms,
            "endoscope": moved(usual.endoscope),
            "depth_camera": moved(usual.depth_camera),
        }
    )


def _edge_holes(scene: Scene, held: Edge) -> NDArray[np.bool_]:
    """The first holes (n,) inwards from an edge, along its middle part."""
    nx, ny = scene.hole_counts
    holes = scene.is_hole.reshape(ny, nx)
    inwards = _INWARDS[held]
    along_x = inwards[0] != 0
    lines = holes if along_x else holes.T
    if sum(inwards) < 0:
        lines = lines[:, ::-1]
    depth = np.cumsum(lines, axis=1)
    chosen = lines & (depth <= _ROWS_HELD)
    count = len(chosen)
    skipped = round((1 - _PART_HELD) / 2 * count)
    chosen[:skipped] = False
    chosen[count - skipped :] = False
    if sum(inwards) < 0:
        chosen = chosen[:, ::-1]
    return (chosen if along_x else chosen.T).ravel()


def _over_hidden_region(scene: Scene, anatomy: Anatomy) -> Scene:
    """With a region that the tissue covers, nearest to its middle and away from what holds it."""
    radius_m = round(min(0.015, 0.16 * min(scene.tissue.length_x_m, scene.tissue.width_y_m)), 4)
    holes_m = scene.holes_xy_m
    held_m = holes_m[scene.attached]
    turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    rim_m = (radius_m + 0.004) * np.column_stack([np.cos(turn), np.sin(turn)])
    tissue = RayCaster(anatomy.surface)
    for place_m in holes_m[np.argsort(np.linalg.norm(holes_m, axis=1), kind="stable")]:
        away_m = np.linalg.norm(held_m - place_m, axis=1).min()
        if away_m < radius_m + scene.attachments.hole_radius_m:
            continue
        if not anatomy.covers(place_m + rim_m).all():
            continue
        x_m, y_m = np.round(place_m, 4)
        roi = Roi(center_x_m=float(x_m), center_y_m=float(y_m), radius_m=radius_m)
        found = scene.model_copy(update={"roi": roi})
        if roi_visibility(found, tissue) == 0.0:
            return found
    raise RefusedSurface(
        f"no place under the tissue hides a region of {1e3 * radius_m:.0f} mm from the endoscope; "
        "the tissue may be too small, or shaped like a tunnel along x"
    )
