"""What moves in the operating field of a timeline: tissue, tools, pictures, beliefs."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from PIL import Image

from defras_bt.recording import palette
from defras_bt.recording.record import RunInfo, TickRecord
from defras_bt.recording.shapes import vertex_normals
from defras_bt.recording.timeline_changes import Changes
from defras_bt.recording.timeline_scene import log_believed, log_scene
from defras_sim.geometry import Floats
from defras_sim.scene import ArmName, Vector
from defras_sim.surface import Surface
from defras_sim.worlds.protocol import ArmObservation, CameraImage

# Surfaces and clouds fill the file: five pictures a second of world time are smooth enough, and a
# surface is written only if a vertex has moved this far since.
_SURFACE_EVERY = 4
_SURFACE_STEP_M = 1e-4
_JPEG_QUALITY = 80


class Field:
    """Writes the scene once, then what changed in it."""

    def __init__(self, stream: rr.RecordingStream, info: RunInfo) -> None:
        self._stream = stream
        self._scene = info.scene
        self._changes = Changes()
        self._surfaces: dict[str, Surface] = {}
        log_scene(stream, info)

    def tick(self, record: TickRecord) -> None:
        self._log_tissue(record)
        for name, described in self._scene.arms.items():
            if (arm := record.observation.arms.get(name)) is not None:
                self._log_arm(name, described.rcm_m, arm)
        self._log_image("endoscope", record.observation.endoscope_image)
        self._log_image("depth_camera", record.observation.depth_image)
        if self._changes.new("believed", record.believed.tobytes()):
            log_believed(self._stream, self._scene, record.believed)

    def _log_tissue(self, record: TickRecord) -> None:
        if record.twin is not None:
            twin = (*palette.TWIN, 64)
            self._log_surface("simulated", record.twin.surface, twin, record.tick)
        if record.true_surface is not None:
            tissue = (*palette.TISSUE, 255)
            self._log_surface("actual", record.true_surface, tissue, record.tick)
        cloud = record.observation.cloud
        if cloud is None or record.tick % _SURFACE_EVERY:
            return
        if not self._changes.new("cloud", cloud.stamp_s):
            return
        colours: NDArray[np.uint8] | palette.Rgb = palette.MUTED
        reading = record.reading
        # The distances belong to the cloud that was monitored, which may be an earlier one.
        if reading is not None and (reading.stamp_s, len(reading.per_point_m)) == (
            cloud.stamp_s,
            len(cloud.points_m),
        ):
            delta_m = self._scene.thresholds.delta_m
            colours = palette.discrepancy_colours(reading.per_point_m, delta_m)
        # Its own path: rerun draws either points or a mesh at one place of the tree.
        points = rr.Points3D(cloud.points_m.astype(np.float32), colors=colours, radii=0.0009)
        self._stream.log("world/tissue/observed", points)

    def _log_surface(self, name: str, surface: Surface, colour: tuple[int, ...], tick: int) -> None:
        before = self._surfaces.get(name)
        same = before is not None and np.array_equal(before.triangles, surface.triangles)
        if before is not None and same:
            moved_m = float(np.abs(surface.vertices_m - before.vertices_m).max())
            if moved_m < _SURFACE_STEP_M or tick % _SURFACE_EVERY:
                return
        self._surfaces[name] = surface
        positions = surface.vertices_m.astype(np.float32)
        normals = vertex_normals(surface.vertices_m, surface.triangles).astype(np.float32)
        if same:
            mesh = rr.Mesh3D.from_fields(vertex_positions=positions, vertex_normals=normals)
        else:
            mesh = rr.Mesh3D(
                vertex_positions=positions,
                vertex_normals=normals,
                triangle_indices=surface.triangles.astype(np.uint32),
                albedo_factor=colour,
            )
        self._stream.log(f"world/tissue/{name}", mesh)

    def _log_arm(self, name: ArmName, rcm_m: Vector, arm: ArmObservation) -> None:
        tip_m = arm.tissue_from_tip.position_m
        shape = (arm.grasped, arm.jaw_rad)
        if not self._changes.new(name, (tip_m.tobytes(), *shape)):
            return
        if self._changes.new(f"{name}/shape", shape):
            self._log_shape(name, arm)
        shaft_m = np.array([tip_m, _up_the_shaft(tip_m, rcm_m)], np.float32)
        self._stream.log(f"world/{name}/shaft", rr.LineStrips3D.from_fields(strips=[shaft_m]))
        self._stream.log(f"world/{name}/tip", rr.Points3D.from_fields(positions=shaft_m[:1]))
        on_map = np.array([tip_m[:2] * (1000, -1000)], np.float32)
        self._stream.log(f"map/{name}", rr.Points2D.from_fields(positions=on_map))

    def _log_shape(self, name: ArmName, arm: ArmObservation) -> None:
        """What seldom changes of how an arm looks."""
        colour, grasped = palette.ARMS[name], bool(arm.grasped)
        self._stream.log(
            f"world/{name}/shaft", rr.LineStrips3D.from_fields(colors=colour, radii=0.0025)
        )
        self._stream.log(
            f"world/{name}/tip",
            rr.Points3D.from_fields(colors=colour, radii=0.0036 if grasped else 0.0026),
        )
        self._stream.log(
            f"map/{name}",
            rr.Points2D.from_fields(
                colors=colour,
                radii=3.6 if grasped else 2.2,
                labels=[name.upper()],
                draw_order=40.0,
            ),
        )

    def _log_image(self, name: str, image: CameraImage | None) -> None:
        if image is None or not self._changes.new(name, image.stamp_s):
            return
        buffer = BytesIO()
        Image.fromarray(image.rgb).save(buffer, format="JPEG", quality=_JPEG_QUALITY)
        self._stream.log(
            f"world/{name}", rr.EncodedImage(contents=buffer.getvalue(), media_type="image/jpeg")
        )


def _up_the_shaft(tip_m: Floats, rcm_m: Vector) -> Floats:
    """A point (3,) 120 mm from the tip towards the remote centre, or the centre if it is nearer."""
    along = np.asarray(rcm_m) - tip_m
    distance = float(np.linalg.norm(along))
    return tip_m + along * min(1.0, 0.12 / distance) if distance > 0 else tip_m
