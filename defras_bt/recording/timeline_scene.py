"""What stands still in the operating field, written to a timeline once."""

from __future__ import annotations

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from defras_bt.recording import palette
from defras_bt.recording.ground import bed_surface, region_outline_m, region_surface
from defras_bt.recording.record import RunInfo
from defras_bt.recording.shapes import circle, vertex_normals
from defras_sim.camera.pinhole import intrinsics, tissue_from_camera
from defras_sim.geometry import Floats
from defras_sim.scene import Camera, Scene

_MM = 1000.0


def log_scene(stream: rr.RecordingStream, info: RunInfo) -> None:
    """Bed, region, holes, cameras; in 3-D and on the map seen from above."""
    scene = info.scene
    log_bed_and_region(stream, scene)
    _log_camera(stream, "endoscope", scene.endoscope)
    _log_camera(stream, "depth_camera", scene.depth_camera)
    if info.actual is not None:
        held = _holes_below_m(scene)[info.actual.attached]
        rings = [circle(place_m, 0.0042, 24) for place_m in held]
        stream.log(
            "world/attachments/actual",
            rr.LineStrips3D(rings, colors=palette.ACTUAL, radii=0.0006),
            static=True,
        )
        flat = [_on_map(ring) for ring in rings]
        stream.log(
            "map/attachments/actual",
            rr.LineStrips2D(flat, colors=palette.ACTUAL, radii=0.6, draw_order=30.0),
            static=True,
        )
    _log_map(stream, scene)


def log_believed(stream: rr.RecordingStream, scene: Scene, believed: NDArray[np.bool_]) -> None:
    """The holes that are believed to hold, as of now."""
    points = _holes_below_m(scene)[believed]
    stream.log(
        "world/attachments/believed",
        rr.Points3D(points, colors=palette.BELIEVED, radii=0.003),
    )
    stream.log(
        "map/attachments/believed",
        rr.Points2D(_on_map(points), colors=palette.BELIEVED, radii=2.9, draw_order=20.0),
    )


def log_bed_and_region(stream: rr.RecordingStream, scene: Scene) -> None:
    """What lies under the tissue."""
    bed, faces = bed_surface(scene, 0.11, 0.10)
    stream.log("world/bed", _mesh(bed, faces, palette.BED), static=True)
    region, faces = region_surface(scene)
    stream.log("world/roi/region", _mesh(region, faces, palette.ROI), static=True)
    outline = region_outline_m(scene) + [0, 0, 0.0005]
    stream.log(
        "world/roi/outline",
        rr.LineStrips3D([outline], colors=palette.ROI, radii=0.0011),
        static=True,
    )


def _mesh(vertices_m: Floats, faces: NDArray[np.int64], colour: palette.Rgb) -> rr.Mesh3D:
    return rr.Mesh3D(
        vertex_positions=vertices_m,
        triangle_indices=faces,
        vertex_normals=vertex_normals(vertices_m, faces),
        albedo_factor=(*colour, 255),
    )


def _log_camera(stream: rr.RecordingStream, name: str, camera: Camera) -> None:
    pose = tissue_from_camera(camera)
    stream.log(
        f"world/{name}",
        rr.Transform3D(translation=pose.position_m, mat3x3=pose.rotation),
        rr.Pinhole(
            image_from_camera=intrinsics(camera),
            resolution=(camera.width_px, camera.height_px),
            camera_xyz=rr.ViewCoordinates.RDF,
            image_plane_distance=0.03,
            color=palette.MUTED,
            line_width=0.0004,
        ),
        static=True,
    )


def _log_map(stream: rr.RecordingStream, scene: Scene) -> None:
    outline = scene.tissue.shape.outline_m
    stream.log(
        "map/tissue",
        rr.LineStrips2D([_on_map(np.concatenate([outline, outline[:1]]))], colors=palette.TISSUE),
        static=True,
    )
    stream.log(
        "map/holes",
        rr.Points2D(_on_map(scene.holes_xy_m[scene.is_hole]), colors=(206, 210, 216), radii=1.0),
        static=True,
    )
    stream.log(
        "map/roi",
        rr.LineStrips2D(
            [_on_map(region_outline_m(scene))],
            colors=palette.ROI,
            radii=0.9,
        ),
        static=True,
    )


def _holes_below_m(scene: Scene) -> Floats:
    """The holes' places (n, 3) just under the tissue at rest."""
    return scene.holes_m - np.array([0.0, 0.0, 0.0008])


def _on_map(points_m: Floats) -> Floats:
    """Millimetres on the map: x to the right, y upwards (rerun's 2-D axis points down)."""
    return np.asarray(points_m)[..., :2] * (_MM, -_MM)
