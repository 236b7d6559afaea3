"""``report.html``: a run as a page that stands on its own."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape
from markupsafe import Markup

from defras_bt.planning.english import action_sentence
from defras_bt.recording import palette
from defras_bt.recording.explain import Explanation, explain
from defras_bt.recording.moment import moment_of
from defras_bt.recording.record import RunInfo, RunSummary, TickRecord
from defras_bt.recording.report_parts import Panel, Tile
from defras_bt.recording.report_plots import (
    attachments_svg,
    depth_picture,
    png_uri,
    signals_svg,
)
from defras_bt.recording.run_log import STATUSES, RunLog
from defras_bt.recording.scene_picture import endoscope_view, field_view, picture
from defras_bt.recording.story import newton, outcome_title, percent, result_sentence, times
from defras_bt.recording.tree_layout import tree_order
from defras_bt.recording.whole_file import write_whole


class ReportRecorder:
    """Collects while the run goes on, and writes ``path`` at the end, however the run ended."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._log: RunLog | None = None

    def start(self, info: RunInfo) -> None:
        self._log = RunLog(info)

    def tick(self, record: TickRecord) -> None:
        if self._log is None:
            raise RuntimeError("a tick came before the start of the run: call start first")
        self._log.add(record)

    def finish(self, summary: RunSummary) -> None:
        if self._log is None:
            return
        write_whole(self._path, report_html(self._log, summary))


def report_html(log: RunLog, summary: RunSummary) -> str:
    """The page. A run that broke off before its first tick gets one without plots."""
    environment = Environment(
        loader=PackageLoader("defras_bt.recording"),
        autoescape=select_autoescape(),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    values = summary.values
    return environment.get_template("report.html").render(
        title=outcome_title(values["outcome"]),
        lead=result_sentence(summary),
        good=values["outcome"] == "goal",
        info=log.info,
        values=values,
        tiles=_tiles(values),
        events=log.events,
        why=_why(log),
        signals=Markup(signals_svg(log)) if log.first is not None else None,
        panels=_panels(log),
        attachments=_attachments(log) if log.first is not None else None,
        truth_known=log.info.actual is not None,
        plans=[
            {
                "begin": begin_s,
                "plan": plan,
                "sentences": [action_sentence(action) for action in plan.actions],
            }
            for begin_s, plan in log.plans
        ],
        nodes=_nodes(log),
        colours={name: palette.css(colour) for name, colour in palette.NODE_STATES.items()},
    )


def _why(log: RunLog) -> Explanation | None:
    """Why the run ended as it did; None where it broke off before its first tick."""
    if log.last is None:
        return None
    return explain(moment_of(log.last, dict(log.info.tree_paths)))


def _tiles(values: Any) -> list[Tile]:
    seen, over = values["roi_visibility"], values["ticks_over_threshold"]
    warnings, updates = values["warnings"], values["attachment_updates"]
    raised = [f"{warnings[state]} × state {state}" for state in "123" if warnings[state]]
    replans = values["replans"]
    anew = f"planned anew {times(replans)}" if replans else "never planned anew"
    limit = f"limit {newton(values['force_threshold_n'])}"
    operator = values["operator"]
    held = f"held for {operator['held_s']:.1f} s" if operator["held_s"] else "never held"
    acts = [Tile("Operator's acts", str(len(operator["acts"])), held)] if operator["acts"] else []
    return [
        Tile(
            "Region visible",
            "unknown" if seen is None else percent(seen),
            "at the end",
            "good" if values["outcome"] == "goal" else "bad",
        ),
        Tile("Actions", str(values["actions"]), anew),
        Tile("Warnings", str(sum(warnings.values())), ", ".join(raised) or "the model agreed"),
        Tile(
            "Attachment updates",
            f"{updates['adopted']} of {updates['tried']}",
            "adopted of those tried",
        ),
        Tile(
            "Largest force, estimated",
            newton(values["force_max_n"]),
            limit,
            "bad" if over else "good",
        ),
        Tile(
            "Largest force, true",
            newton(values["force_max_true_n"]),
            "only a simulated world knows it",
        ),
        Tile("Mean force", newton(values["force_mean_n"]), "estimated, while holding"),
        Tile("Time over the limit", f"{values['time_over_threshold_s']:.1f} s", f"{over} ticks"),
        Tile(
            "Duration",
            f"{values['duration_s']:.1f} s",
            f"world time; {values['wall_s']:.0f} s on the clock",
        ),
        *acts,
        *_stream_tiles(values.get("stream")),
    ]


def _stream_tiles(stream: Any) -> list[Tile]:
    """How set-points were streamed to real arms; none for a simulated world."""
    if stream is None or stream["period"]["p99_s"] is None:
        return []
    period = stream["period"]
    late = period["p99_s"] > 1.2 * period["nominal_s"]
    regular = Tile(
        "Between set-points",
        _milliseconds(period["p99_s"]),
        f"99 of 100; nominal {_milliseconds(period['nominal_s'])}, longest "
        f"{_milliseconds(period['longest_s'])}",
        "bad" if late else "plain",
    )
    ways = [
        f"{sensor} {_milliseconds(way['median_s'])} ({_milliseconds(way['p99_s'])})"
        for sensor, way in stream["latency"].items()
    ]
    if not ways:
        return [regular]
    slowest = max(way["median_s"] for way in stream["latency"].values())
    return [
        regular,
        Tile("Sensor to command", _milliseconds(slowest), f"median (99 of 100): {', '.join(ways)}"),
    ]


def _milliseconds(time_s: float) -> str:
    return f"{time_s * 1e3:.1f} ms"


def _panels(log: RunLog) -> list[Panel]:
    """The field before and after, actual (else simulated); what the cameras saw."""
    panels = []
    moments = [("Before", log.first), ("After", log.last)]
    for when, record in moments:
        if record is None:
            continue
        known = record.true_surface is not None
        drawn = picture(record, log.info, field_view(), simulated=not known)
        if drawn is not None:
            which = "as it is" if known else "as simulated"
            panels.append(Panel(f"{when}: the field {which}", png_uri(drawn)))
    if log.last is not None and log.last.true_surface is not None:
        drawn = picture(log.last, log.info, field_view(), simulated=True)
        if drawn is not None:
            panels.append(Panel("After: the field as the simulation has it", png_uri(drawn)))
    return panels + (_camera_panels(log) if log.with_pictures else _drawn_endoscope(log))


def _camera_panels(log: RunLog) -> list[Panel]:
    panels = []
    for when, record in zip(("Before", "After"), log.with_pictures, strict=False):
        image = record.observation.endoscope_image
        if image is not None:
            panels.append(Panel(f"{when}: the endoscope's picture", png_uri(image.rgb)))
    depth = log.with_pictures[-1].observation.depth_image
    if depth is not None:
        panels.append(Panel("After: the depth camera's picture", png_uri(depth.rgb)))
        if depth.depth_m is not None:
            shown = png_uri(depth_picture(depth.depth_m))
            panels.append(Panel("After: its depth, near is bright", shown))
    return panels


def _drawn_endoscope(log: RunLog) -> list[Panel]:
    panels = []
    for when, record in (("Before", log.first), ("After", log.last)):
        if record is None:
            continue
        simulated = record.true_surface is None
        drawn = picture(record, log.info, endoscope_view(log.info.scene), simulated=simulated)
        if drawn is not None:
            panels.append(Panel(f"{when}: from the endoscope (drawn)", png_uri(drawn)))
    return panels


def _attachments(log: RunLog) -> Markup:
    columns = [("Believed before", log.info.believed)]
    learned = [belief for belief in log.beliefs if not np.array_equal(belief[1], log.info.believed)]
    if learned:
        begin_s, held = learned[-1]
        columns.append((f"Believed at the end (from {begin_s:.1f} s)", held))
    actual = None if log.info.actual is None else log.info.actual.attached
    if actual is not None:
        columns.append(("Actual", actual))
    return Markup(attachments_svg(log.info.scene, tuple(columns), actual))


def _nodes(log: RunLog) -> list[dict[str, Any]]:
    """Every node with the share of all ticks that it said each status."""
    kinds = dict(log.info.tree_paths)
    paths = [*kinds, *(path for path in log.node_ticks if path not in kinds)]
    total = max(1, len(log.column("time_s")))
    nodes = []
    for path in tree_order(paths):
        counts = log.node_ticks.get(path, Counter())
        shares = [(s, counts[s], 100 * counts[s] / total) for s in STATUSES if counts[s]]
        name, depth = path.rpartition("/")[2], path.count("/")
        kind = kinds.get(path, "action of a plan")
        nodes.append({"name": name, "depth": depth, "kind": kind, "shares": shares})
    return nodes
