"""``run.rrd``: the whole run on a rerun timeline."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray
from PIL import Image

from defras_bt.recording import palette
from defras_bt.recording.record import Event, RunInfo, RunSummary, TickRecord
from defras_bt.recording.shapes import vertex_normals
from defras_bt.recording.story import outcome_sentence, plan_markdown
from defras_bt.recording.timeline_blueprint import APPLICATION, default_blueprint
from defras_bt.recording.timeline_scene import log_believed, log_scene
from defras_bt.recording.tree_layout import parent_of, tree_layout, tree_order
from defras_sim.geometry import Floats
from defras_sim.scene import ArmName, Vector
from defras_sim.surface import Surface
from defras_sim.worlds.protocol import ArmObservation, CameraImage

# Surfaces and clouds fill the file: five pictures a second of world time are smooth enough, and a
# surface is written only if a vertex has moved this far since.
_SURFACE_EVERY = 4
_SURFACE_STEP_M = 1e-4
_JPEG_QUALITY = 80
# So many ticks share a chunk of the file: each costs a kilobyte of its own.
_FLUSH_EVERY = 20
_LIMITS_EVERY = 20
_LEVELS = {
    "info": rr.TextLogLevel.INFO,
    "warning": rr.TextLogLevel.WARN,
    "error": rr.TextLogLevel.ERROR,
}


class TimelineRecorder:
    """Writes ``path``; a killed process loses at most its last second.

    Two runs that are equal tick by tick give recordings that compare equal: no batching by time or
    size, no log time, an id derived from what was run, nothing that depends on the wall clock.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._stream: rr.RecordingStream | None = None
        self._info: RunInfo | None = None
        self._kinds: dict[str, str] = {}
        self._status: dict[str, str] = {}
        self._surfaces: dict[str, Surface] = {}
        self._last: dict[str, object] = {}

    def start(self, info: RunInfo) -> None:
        stream = rr.RecordingStream(
            APPLICATION,
            recording_id=_recording_id(info),
            batcher_config=rr.ChunkBatcherConfig.NEVER(),
            # Properties would hold the time of day.
            send_properties=False,
        )
        stream.set_log_time_enabled(False)
        stream.save(self._path, default_blueprint=_layout(info, pictures=False))
        self._stream, self._info = stream, info
        log_scene(stream, info)
        self._log_series()
        self._log_lane("monitor/warning_state", _WARNING_LANE)
        self._log_lane("plan/action", {name: (name, c) for name, c in palette.ACTIONS.items()})
        self._kinds = dict(info.tree_paths)
        for path, _ in info.tree_paths:
            self._log_lane(_lane_of(path), _NODE_LANE)
        self._set_time(0, 0.0)
        self._log_tree({})
        stream.flush()

    def tick(self, record: TickRecord) -> None:
        stream, info = self._started()
        self._set_time(record.tick, record.time_s)
        self._log_signals(record)
        self._log_lanes(record, info)
        self._log_tissue(record, info)
        for name, described in info.scene.arms.items():
            if (arm := record.observation.arms.get(name)) is not None:
                self._log_arm(name, described.rcm_m, arm)
        seen = record.observation.endoscope_image is not None
        if self._changed("pictures", seen) and seen:
            stream.send_blueprint(_layout(info, pictures=True))
        self._log_image("endoscope", record.observation.endoscope_image)
        self._log_image("depth_camera", record.observation.depth_image)
        if self._changed("believed", record.believed.tobytes()):
            log_believed(stream, info.scene, record.believed)
        if self._changed("plan", (record.plan, record.plan_step)):
            document = rr.TextDocument(plan_markdown(record.plan, record.plan_step), media_type=_MD)
            stream.log("plan", document)
        for event in record.events:
            self._log_event(event)
        urgent = any(event.level == "error" for event in record.events)
        if urgent or record.tick % _FLUSH_EVERY == 0:
            stream.flush()

    def finish(self, summary: RunSummary) -> None:
        if self._stream is None:
            return
        outcome = summary.values.get("outcome")
        if outcome is not None:
            level = rr.TextLogLevel.INFO if outcome == "goal" else rr.TextLogLevel.ERROR
            self._stream.log("log/outcome", rr.TextLog(outcome_sentence(summary), level=level))
        self._log_limits()
        self._stream.flush()
        self._stream.disconnect()

    def _started(self) -> tuple[rr.RecordingStream, RunInfo]:
        if self._stream is None or self._info is None:
            raise RuntimeError("a tick came before the start of the run: call start first")
        return self._stream, self._info

    def _log(self, path: str | list[str], *what: rr.AsComponents, static: bool = False) -> None:
        self._started()[0].log(path, *what, static=static)

    def _set_time(self, tick: int, time_s: float) -> None:
        stream, _ = self._started()
        stream.set_time("tick", sequence=tick)
        stream.set_time("sim_time", duration=time_s)

    def _changed(self, key: str, value: object) -> bool:
        if key in self._last and self._last[key] == value:
            return False
        self._last[key] = value
        return True

    # Signals ---------------------------------------------------------------------------------

    def _log_series(self) -> None:
        for path, (names, colours, width) in _SERIES.items():
            lines = rr.SeriesLines(names=names, colors=_rgba(colours), widths=[width] * len(names))
            self._log(f"signals/{path}", lines, static=True)

    def _log_signals(self, record: TickRecord) -> None:
        measured = {} if record.reading is None else record.reading.mu_m
        for path, value in {
            "force_n/estimated": record.force_n,
            "force_n/true": record.true_force_n,
            **{f"mu_mm/{metric}": 1000 * mu_m for metric, mu_m in measured.items()},
            "rate": record.rate,
            "visibility": record.observation.roi_visibility,
        }.items():
            # Not a number makes a gap; written down, it would compare unequal to itself.
            if value is not None and math.isfinite(value):
                self._log(f"signals/{path}", rr.Scalars(value))
        if record.tick % _LIMITS_EVERY == 0:
            self._log_limits()

    def _log_limits(self) -> None:
        """Limits are constant: enough points to draw a line, and one at the end."""
        _, info = self._started()
        deltas_mm = [1000 * delta_m for delta_m in info.scene.thresholds.delta_m]
        self._log("signals/mu_mm/thresholds", rr.Scalars(deltas_mm))
        self._log("signals/force_n/epsilon", rr.Scalars(info.force_threshold_n))

    # Lanes and tree --------------------------------------------------------------------------

    def _log_lane(
        self, path: str | list[str], states: Mapping[str, tuple[str, palette.Rgb]]
    ) -> None:
        configuration = rr.StateConfiguration(
            values=list(states),
            labels=[label for label, _ in states.values()],
            colors=_rgba([colour for _, colour in states.values()]),
        )
        self._log(path, configuration, static=True)

    def _log_lanes(self, record: TickRecord, info: RunInfo) -> None:
        state = None if record.reading is None else record.reading.warning_state.get(info.metric)
        if self._changed("warning_state", state):
            said = "" if state is None else str(state)
            self._log("monitor/warning_state", rr.StateChange(state=said))
        plan, step = record.plan, record.plan_step
        action = plan.actions[step] if plan is not None and step < len(plan.actions) else None
        if self._changed("action", action):
            self._log("plan/action", rr.StateChange(state="" if action is None else action.name))
        self._log_nodes(record.node_status)

    def _log_nodes(self, status: Mapping[str, str]) -> None:
        fresh = [path for path in status if path not in self._kinds]
        for path in fresh:
            # Leaves made from a plan join the tree while it runs.
            self._kinds[path] = "Action"
            self._log_lane(_lane_of(path), _NODE_LANE)
        now = {path: status.get(path, "") for path in self._kinds}
        changed = {path: s for path, s in now.items() if s != self._status.get(path, "")}
        for path, state in changed.items():
            self._log(_lane_of(path), rr.StateChange(state=state))
        self._status = now
        if fresh:
            self._log_tree(now)
        elif changed:
            colours = _rgba([palette.NODE_STATES.get(s, _IDLE) for s in now.values()])
            self._log("tree/graph", rr.GraphNodes.from_fields(colors=colours))

    def _log_tree(self, status: Mapping[str, str]) -> None:
        paths = list(self._kinds)
        places = tree_layout(tree_order(paths))
        edges = [(p, path) for path in paths if (p := parent_of(path)) is not None]
        self._log(
            "tree/graph",
            rr.GraphNodes(
                paths,
                positions=[places[path] for path in paths],
                labels=[path.rpartition("/")[2] for path in paths],
                colors=_rgba([palette.NODE_STATES.get(status.get(p, ""), _IDLE) for p in paths]),
            ),
            rr.GraphEdges(edges, graph_type="directed"),
        )

    # Operating field -------------------------------------------------------------------------

    def _log_tissue(self, record: TickRecord, info: RunInfo) -> None:
        if record.twin is not None:
            twin = (*palette.TWIN, 64)
            self._log_surface("simulated", record.twin.surface, twin, record.tick)
        if record.true_surface is not None:
            tissue = (*palette.TISSUE, 255)
            self._log_surface("actual", record.true_surface, tissue, record.tick)
        cloud = record.observation.cloud
        if cloud is None or record.tick % _SURFACE_EVERY:
            return
        if not self._changed("cloud", cloud.stamp_s):
            return
        colours: NDArray[np.uint8] | palette.Rgb = palette.MUTED
        reading = record.reading
        # The distances belong to the cloud that was monitored, which may be an earlier one.
        if reading is not None and (reading.stamp_s, len(reading.per_point_m)) == (
            cloud.stamp_s,
            len(cloud.points_m),
        ):
            delta_m = info.scene.thresholds.delta_m
            colours = palette.discrepancy_colours(reading.per_point_m, delta_m)
        # Its own path: rerun draws either points or a mesh at one place of the tree.
        points = rr.Points3D(cloud.points_m.astype(np.float32), colors=colours, radii=0.0009)
        self._log("world/tissue/observed", points)

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
        self._log(f"world/tissue/{name}", mesh)

    def _log_arm(self, name: ArmName, rcm_m: Vector, arm: ArmObservation) -> None:
        pose = arm.tissue_from_tip
        if not self._changed(name, (pose.position_m.tobytes(), arm.grasped, arm.jaw_rad)):
            return
        tip_m, colour = pose.position_m, palette.ARMS[name]
        shaft = np.array([tip_m, _up_the_shaft(tip_m, rcm_m)])
        self._log(f"world/{name}/shaft", rr.LineStrips3D([shaft], colors=colour, radii=0.0025))
        size_m = 0.0036 if arm.grasped else 0.0026
        self._log(f"world/{name}/tip", rr.Points3D([tip_m], colors=colour, radii=size_m))
        self._log(
            f"map/{name}",
            rr.Points2D(
                [tip_m[:2] * (1000, -1000)],
                colors=colour,
                radii=3.6 if arm.grasped else 2.2,
                labels=[name.upper()],
                draw_order=40.0,
            ),
        )

    def _log_image(self, name: str, image: CameraImage | None) -> None:
        if image is None or not self._changed(name, image.stamp_s):
            return
        buffer = BytesIO()
        Image.fromarray(image.rgb).save(buffer, format="JPEG", quality=_JPEG_QUALITY)
        self._log(
            f"world/{name}", rr.EncodedImage(contents=buffer.getvalue(), media_type="image/jpeg")
        )

    def _log_event(self, event: Event) -> None:
        self._log(f"log/{event.kind}", rr.TextLog(event.sentence, level=_LEVELS[event.level]))


_MD = "text/markdown"
_SERIES: dict[str, tuple[tuple[str, ...], tuple[palette.Rgb, ...], float]] = {
    "force_n/estimated": (("estimated",), (palette.ESTIMATED,), 2.0),
    "force_n/true": (("true",), (palette.TRUE,), 2.0),
    "force_n/epsilon": (("epsilon",), (palette.WARNING_STATES[3],), 1.0),
    "mu_mm/local": (("local",), (palette.ESTIMATED,), 2.0),
    "mu_mm/median": (("median",), (palette.MEDIAN,), 2.0),
    "mu_mm/thresholds": (("delta1", "delta2", "delta3"), palette.WARNING_STATES[1:], 1.0),
    "rate": (("rate",), (palette.ARMS["psm1"],), 2.0),
    "visibility": (("visibility",), (palette.ROI,), 2.0),
}
_IDLE: palette.Rgb = (224, 228, 233)
_NODE_LANE = {state: (state.lower(), colour) for state, colour in palette.NODE_STATES.items()}
_WARNING_LANE = {
    str(state): (label, colour)
    for state, (label, colour) in enumerate(
        zip(
            ("0 agrees", "1 slow down, learn", "2 stop, re-plan", "3 ask a human"),
            palette.WARNING_STATES,
            strict=True,
        )
    )
}


def _recording_id(info: RunInfo) -> str:
    """The same run has the same id; recordings with one id would be merged in the viewer."""
    what = (info.scene_file, info.actual_file, info.world, info.tree, info.seed)
    return hashlib.sha256(repr(what).encode()).hexdigest()[:32]


def _layout(info: RunInfo, *, pictures: bool) -> rrb.Blueprint:
    return default_blueprint(truth_known=info.actual is not None, pictures=pictures)


def _lane_of(path: str) -> list[str]:
    return ["executive", *path.split("/")]


def _rgba(colours: object) -> NDArray[np.uint32]:
    """Packed colours: rerun cannot take four plain integers for four colours."""
    rgb = np.asarray(colours, np.uint32).reshape(-1, 3)
    return (rgb @ np.array([1 << 24, 1 << 16, 1 << 8], np.uint32) + 255).astype(np.uint32)


def _up_the_shaft(tip_m: Floats, rcm_m: Vector) -> Floats:
    """A point (3,) 120 mm from the tip towards the remote centre, or the centre if it is nearer."""
    along = np.asarray(rcm_m) - tip_m
    distance = float(np.linalg.norm(along))
    return tip_m + along * min(1.0, 0.12 / distance) if distance > 0 else tip_m
