"""``diagnosis.rrd``: what was seen beside both models, on a rerun timeline."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from defras_bt.diagnosis.diagnosis import Diagnosis
from defras_bt.diagnosis.exhibits import Exhibits, ReplayFrame
from defras_bt.diagnosis.pictures_time import Row, curve, phase_spans, rows, striking_rows
from defras_bt.diagnosis.report_words import unit_shown
from defras_bt.diagnosis.timeline_blueprint import APPLICATION, Plot, blueprint
from defras_bt.diagnosis.verdict_file import Origin
from defras_bt.recording import palette
from defras_bt.recording.drain import Drain
from defras_bt.recording.shapes import vertex_normals
from defras_bt.recording.timeline_changes import packed
from defras_bt.recording.timeline_scene import log_bed_and_region, log_believed
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.surface import Surface

BEFORE, AFTER, NOISE = (214, 92, 76), palette.ESTIMATED, (120, 150, 130)
_PAUSE_S = 1.0
"""Recordings lie one after another on the timeline, with this much between."""
_PHASE_COLOURS = ((88, 150, 220), (40, 170, 140), (128, 110, 200), (240, 196, 66), (200, 170, 120))
_FLUSH_EVERY = 200


def write_timeline(
    diagnosis: Diagnosis,
    origin: Origin,
    sentence: str,
    path: Path,
    *,
    scene: Scene | None = None,
    exhibits: Exhibits | None = None,
) -> None:
    """Write ``path``; the same diagnosis gives a recording that compares equal.

    Raises:
        OSError: it cannot be written.
    """
    drain = Drain(path)
    what = repr((origin.model_dump(), sentence)).encode()
    stream = rr.RecordingStream(
        APPLICATION,
        recording_id=hashlib.sha256(what).hexdigest()[:32],
        batcher_config=rr.ChunkBatcherConfig.NEVER(),
        send_properties=False,
    )
    stream.set_log_time_enabled(False)
    shown = exhibits or Exhibits()
    lines = rows(diagnosis.samples)
    striking = striking_rows(diagnosis)
    extended = diagnosis.model != diagnosis.base
    plots = [_plot(diagnosis, row) for row in striking]
    layout = blueprint(plots, replay=bool(shown.replay), extended=extended)
    stream.save(drain.inlet, default_blueprint=layout)
    try:
        words = rr.TextDocument(_markdown(diagnosis, sentence), media_type="text/markdown")
        stream.log("verdict", words, static=True)
        starts_s = _starts_s(diagnosis, shown)
        _log_phases(stream, diagnosis, starts_s)
        for row in lines:
            _log_row(stream, diagnosis, row, starts_s, extended=extended)
        if scene is not None and shown.replay:
            _log_replay(stream, shown.replay, scene, starts_s, extended=extended)
    finally:
        stream.flush()
        stream.disconnect()
        drain.close()


def _starts_s(diagnosis: Diagnosis, exhibits: Exhibits) -> dict[str, float]:
    """When each recording begins on the timeline, less its own first time."""
    samples, starts, end_s = diagnosis.samples, {}, 0.0
    for index, name in enumerate(samples.trajectories):
        times = [
            *samples.time_s[samples.trajectory == index],
            *(frame.time_s for frame in exhibits.replay if frame.trajectory == name),
        ]
        if times:
            starts[name] = end_s - float(min(times))
            end_s += float(max(times) - min(times)) + _PAUSE_S
    return starts


def _log_phases(
    stream: rr.RecordingStream, diagnosis: Diagnosis, starts_s: dict[str, float]
) -> None:
    phases = diagnosis.samples.phases
    colours = [_PHASE_COLOURS[i % len(_PHASE_COLOURS)] for i in range(len(phases))]
    configuration = rr.StateConfiguration(
        values=list(phases), labels=list(phases), colors=packed(colours)
    )
    stream.log("motion/phase", configuration, static=True)
    names = diagnosis.samples.trajectories
    tones = [palette.MUTED if i % 2 else palette.BELIEVED for i in range(len(names))]
    stream.log(
        "motion/recording",
        rr.StateConfiguration(values=list(names), labels=list(names), colors=packed(tones)),
        static=True,
    )
    for index, name in enumerate(names):
        its_s = diagnosis.samples.time_s[diagnosis.samples.trajectory == index]
        if not len(its_s):
            continue
        for lane, spans in (
            ("phase", phase_spans(diagnosis.samples, index)),
            ("recording", [(float(its_s.min()), float(its_s.max()), name)]),
        ):
            for begin_s, _, state in spans:
                stream.set_time("time", duration=begin_s + starts_s[name])
                stream.log(f"motion/{lane}", rr.StateChange(state=state))
            if spans:
                stream.set_time("time", duration=spans[-1][1] + starts_s[name])
                stream.log(f"motion/{lane}", rr.StateChange(state=""))


def _log_row(
    stream: rr.RecordingStream,
    diagnosis: Diagnosis,
    row: Row,
    starts_s: dict[str, float],
    *,
    extended: bool,
) -> None:
    factor, _ = unit_shown(row.unit)
    place, samples = f"residual/{_place(row)}", diagnosis.samples
    series = [("as it was", BEFORE, diagnosis.held_out_before)]
    if extended:
        series.append(("extended", AFTER, diagnosis.held_out_after))
    for name, colour, residual in series:
        path = f"{place}/{name}".replace(" ", "_")
        stream.log(path, rr.SeriesLines(names=[name], colors=packed([colour])), static=True)
        for index, trajectory in enumerate(samples.trajectories):
            time_s, values = curve(samples, row, index, residual)
            known = np.isfinite(values)
            shifted_s = time_s[known] + starts_s.get(trajectory, 0.0)
            _send(stream, path, shifted_s, factor * values[known])
    noise = f"{place}/noise"
    stream.log(noise, rr.SeriesLines(names=["sensor noise"], colors=packed([NOISE])), static=True)
    times = [*starts_s.values()]
    begin, end = samples.time_s.min() + min(times), samples.time_s.max() + max(times)
    _send(stream, noise, np.array([begin, end]), np.full(2, factor * row.noise_sd))


def _plot(diagnosis: Diagnosis, row: Row) -> Plot:
    """Where the curves of ``row`` stand, and what they span, with some room."""
    factor, unit = unit_shown(row.unit)
    curves = [
        curve(diagnosis.samples, row, index, diagnosis.held_out_before)[1]
        for index in range(len(diagnosis.samples.trajectories))
    ]
    seen = np.abs(np.concatenate(curves))
    most = 1.15 * factor * max(float(np.nanmax(seen, initial=0.0)), 3 * row.noise_sd)
    what = row.name if row.signed else f"{row.name}, rms"
    return Plot(_place(row), f"Difference, {what} [{unit or '1'}]", -most * row.signed, most)


def _send(stream: rr.RecordingStream, path: str, time_s: Floats, values: Floats) -> None:
    if len(time_s):
        column = rr.TimeColumn("time", duration=time_s)
        stream.send_columns(path, [column], rr.Scalars.columns(scalars=values))


def _log_replay(
    stream: rr.RecordingStream,
    replay: tuple[ReplayFrame, ...],
    scene: Scene,
    starts_s: dict[str, float],
    *,
    extended: bool,
) -> None:
    stream.reset_time()
    log_bed_and_region(stream, scene)
    stream.set_time("time", duration=min(f.time_s + starts_s[f.trajectory] for f in replay))
    log_believed(stream, scene, scene.attached)
    topology: dict[str, NDArray[np.int64]] = {}
    for index, frame in enumerate(replay):
        stream.set_time("time", duration=frame.time_s + starts_s[frame.trajectory])
        _log_surface(stream, "plain", frame.plain, palette.TWIN, topology)
        _log_points(stream, "observed_plain", frame.plain_cloud_m, frame.before_m, scene)
        if extended:
            _log_surface(stream, "extended", frame.extended, palette.TWIN, topology)
            _log_points(stream, "observed_extended", frame.extended_cloud_m, frame.after_m, scene)
        for arm, tip_m in frame.tips_m.items():
            size_m = 0.0036 if arm in frame.held else 0.0026
            colour = palette.ARMS.get(arm, palette.MUTED)
            stream.log(f"world/{arm}", rr.Points3D([tip_m], colors=colour, radii=size_m))
        if index % _FLUSH_EVERY == 0:
            stream.flush()


def _log_surface(
    stream: rr.RecordingStream,
    name: str,
    surface: Surface,
    colour: palette.Rgb,
    topology: dict[str, NDArray[np.int64]],
) -> None:
    positions = surface.vertices_m.astype(np.float32)
    normals = vertex_normals(surface.vertices_m, surface.triangles).astype(np.float32)
    if name in topology and np.array_equal(topology[name], surface.triangles):
        mesh = rr.Mesh3D.from_fields(vertex_positions=positions, vertex_normals=normals)
    else:
        topology[name] = surface.triangles
        mesh = rr.Mesh3D(
            vertex_positions=positions,
            vertex_normals=normals,
            triangle_indices=surface.triangles.astype(np.uint32),
            albedo_factor=(*colour, 96),
        )
    stream.log(f"world/tissue/{name}", mesh)


def _log_points(
    stream: rr.RecordingStream, name: str, cloud_m: Floats, distance_m: Floats, scene: Scene
) -> None:
    colours = palette.discrepancy_colours(np.abs(distance_m), scene.thresholds.delta_m)
    points = rr.Points3D(cloud_m.astype(np.float32), colors=colours, radii=0.0009)
    stream.log(f"world/tissue/{name}", points)


def _markdown(diagnosis: Diagnosis, sentence: str) -> str:
    lines = [f"**{sentence}**", ""]
    lines += [f"* {s.sentence}" for s in diagnosis.portrait if s.stands_out]
    lines += [f"* {warning}" for warning in diagnosis.verdict.warnings]
    if diagnosis.verdict.proposed_motion:
        lines.append(f"* What would settle it: {diagnosis.verdict.proposed_motion}")
    return "\n".join(lines)


def _place(row: Row) -> str:
    return row.name.replace(" ", "_").replace("/", "_")
