"""What stands still in the operating field, written to a timeline once."""

from __future__ import annotations

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from defras_bt.recording import palette
from defras_bt.recording.record import RunInfo
from defras_bt.recording.shapes import circle, disc, rectangle
from defras_sim.camera.pinhole import intrinsics, tissue_from_camera
from defras_sim.geometry import Floats
from defras_sim.scene import Camera, Scene

_MM = 1000.0


def log_scene(stream: rr.RecordingStream, info: RunInfo) -> None:
    """Bed, region, holes, cameras; in 3-D and on the map seen from above."""
    scene = info.scene
    _log_bed_and_region(stream, scene)
    _log_camera(stream, "endoscope", scene.endoscope)
    _log_camera(stream, "depth_camera", scene.depth_camera)
    if info.actual is not None:
        held = scene.holes_xy_m[info.actual.attached]
        rings = [circle(_below(scene, xy), 0.0042, 24) for xy in held]
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
    xy = scene.holes_xy_m[believed]
    points = np.array([_below(scene, hole) for hole in xy]).reshape(-1, 3)
    stream.log(
        "world/attachments/believed",
        rr.Points3D(points, colors=palette.BELIEVED, radii=0.003),
    )
    stream.log(
        "map/attachments/believed",
        rr.Points2D(_on_map(points), colors=palette.BELIEVED, radii=2.9, draw_order=20.0),
    )


def _log_bed_and_region(stream: rr.RecordingStream, scene: Scene) -> None:
    center = scene.roi_center_m
    bed, faces = rectangle(0.11, 0.10, float(center[2]) - 0.0015)
    stream.log("world/bed", _flat(bed, faces, palette.BED), static=True)
    region, faces = disc(center, scene.roi.radius_m)
    stream.log("world/roi/region", _flat(region, faces, palette.ROI), static=True)
    outline = circle(center + [0, 0, 0.0005], scene.roi.radius_m)
    stream.log(
        "world/roi/outline",
        rr.LineStrips3D([outline], colors=palette.ROI, radii=0.0011),
        static=True,
    )


def _flat(vertices_m: Floats, faces: NDArray[np.int64], colour: palette.Rgb) -> rr.Mesh3D:
    return rr.Mesh3D(
        vertex_positions=vertices_m,
        triangle_indices=faces,
        vertex_normals=np.tile([0.0, 0.0, 1.0], (len(vertices_m), 1)),
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
    half_x, half_y = scene.tissue.length_x_m / 2 * _MM, scene.tissue.width_y_m / 2 * _MM
    stream.log(
        "map/tissue",
        rr.Boxes2D(centers=[(0, 0)], half_sizes=[(half_x, half_y)], colors=palette.TISSUE),
        static=True,
    )
    stream.log(
        "map/holes",
        rr.Points2D(scene.holes_xy_m * (_MM, -_MM), colors=(206, 210, 216), radii=1.0),
        static=True,
    )
    stream.log(
        "map/roi",
        rr.LineStrips2D(
            [_on_map(circle(scene.roi_center_m, scene.roi.radius_m))],
            colors=palette.ROI,
            radii=0.9,
        ),
        static=True,
    )


def _below(scene: Scene, xy_m: Floats) -> Floats:
    """A hole's place (3,) just under the tissue at rest."""
    return np.array([xy_m[0], xy_m[1], -scene.tissue.thickness_m - 0.0008])


def _on_map(points_m: Floats) -> Floats:
    """Millimetres on the map: x to the right, y upwards (rerun's 2-D axis points down)."""
    return np.asarray(points_m)[..., :2] * (_MM, -_MM)
