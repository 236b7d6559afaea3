"""The operating field as a picture: bed, region, attachments, tissue, tools."""

from __future__ import annotations

import numpy as np
import trimesh
from numpy.typing import NDArray

from defras_bt.recording import palette
from defras_bt.recording.ground import bed_surface, region_surface
from defras_bt.recording.record import RunInfo, TickRecord
from defras_bt.recording.rendering import Body, View, render
from defras_bt.recording.shapes import disc
from defras_sim.camera.pinhole import looking_at, tissue_from_camera
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.surface import Surface

_WIDTH_PX, _HEIGHT_PX = 520, 360
_BED: palette.Rgb = (205, 216, 222)
_SHAFT_M, _SHAFT_RADIUS_M = 0.11, 0.0027


def field_view() -> View:
    """As an assistant sees it who stands at the endoscope's right."""
    pose = looking_at(np.array([-0.17, -0.21, 0.17]), np.array([0.0, 0.0, 0.018]))
    return View(pose, 0.58, _WIDTH_PX, _HEIGHT_PX)


def endoscope_view(scene: Scene) -> View:
    camera = scene.endoscope
    width_px = round(_HEIGHT_PX * camera.width_px / camera.height_px)
    pose = tissue_from_camera(camera)
    return View(pose, camera.vertical_fov_rad, width_px, _HEIGHT_PX)


def picture(
    record: TickRecord, info: RunInfo, view: View, *, simulated: bool
) -> NDArray[np.uint8] | None:
    """The field as the twin has it, or as it is; None where that is unknown."""
    twin = None if record.twin is None else record.twin.surface
    surface = twin if simulated else record.true_surface
    if surface is None:
        return None
    held = record.believed if simulated or info.actual is None else info.actual.attached
    return render(
        [*_surroundings(info.scene, held), *_tools(record, info), *_tissue(surface, simulated)],
        view,
    )


def _tissue(surface: Surface, simulated: bool) -> list[Body]:
    colour = palette.TWIN if simulated else palette.TISSUE
    return [Body(surface.vertices_m, surface.triangles, colour)]


def _surroundings(scene: Scene, held: NDArray[np.bool_]) -> list[Body]:
    bodies = [
        Body(*bed_surface(scene, 0.16, 0.14), _BED),
        Body(*region_surface(scene), palette.ROI),
    ]
    for place_m in scene.holes_m[held] - [0.0, 0.0, 0.0006]:
        bodies.append(Body(*disc(place_m, 0.0032, 16), palette.BELIEVED))
    return bodies


def _tools(record: TickRecord, info: RunInfo) -> list[Body]:
    bodies = []
    for name, arm in info.scene.arms.items():
        seen = record.observation.arms.get(name)
        if seen is not None:
            tip_m = seen.tissue_from_tip.position_m
            bodies.append(_shaft(tip_m, np.asarray(arm.rcm_m), palette.ARMS[name]))
    return bodies


def _shaft(tip_m: Floats, rcm_m: Floats, colour: palette.Rgb) -> Body:
    along = (rcm_m - tip_m) / np.linalg.norm(rcm_m - tip_m)
    # The jaw's last millimetres are inside the tissue that it holds.
    segment = np.stack([tip_m + 0.001 * along, tip_m + _SHAFT_M * along])
    tube = trimesh.creation.cylinder(_SHAFT_RADIUS_M, segment=segment, sections=20)
    return Body(np.asarray(tube.vertices), np.asarray(tube.faces), colour)
