"""The figures of a report, as SVG text or embedded PNG."""

from __future__ import annotations

import base64
from io import BytesIO

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle
from numpy.typing import NDArray
from PIL import Image

from defras_bt.recording import palette
from defras_bt.recording.figures import FIGURE_STYLE, svg_text
from defras_bt.recording.palette import css
from defras_bt.recording.run_log import RunLog, Span
from defras_sim.geometry import Floats
from defras_sim.scene import Scene

_METRIC_COLOURS = (palette.ESTIMATED, palette.MEDIAN, palette.ROI)


def signals_svg(log: RunLog) -> str:
    """Actions, warning state, discrepancy, force, rate and visibility over one time axis."""
    with matplotlib.rc_context(FIGURE_STYLE):
        figure = Figure(figsize=(10.2, 8.0))
        axes = figure.subplots(
            5, 1, sharex=True, height_ratios=[0.42, 0.3, 2, 2, 1.35], gridspec_kw={"hspace": 0.16}
        )
        time_s = log.column("time_s")
        end_s = max(float(time_s[-1]), float(time_s[0]) + 1e-3)
        axes[0].set_xlim(float(time_s[0]), end_s)
        _strip(axes[0], log.actions, {k: css(v) for k, v in palette.ACTIONS.items()}, "Action")
        states = {str(i): css(colour) for i, colour in enumerate(palette.WARNING_STATES)}
        _strip(axes[1], log.warning_states, states, "Warning")
        _discrepancy(axes[2], log, time_s)
        _force(axes[3], log, time_s)
        _rate(axes[4], log, time_s)
        for axis in axes[2:]:
            for span in log.actions:
                shade = css(palette.ACTIONS.get(span.name, palette.MUTED))
                axis.axvspan(span.begin_s, span.end_s, color=shade, alpha=0.09, linewidth=0)
        axes[4].set_xlabel("world time [s]")
        figure.align_ylabels(list(axes))
        return svg_text(figure, "Signals of the run over time")


def attachments_svg(
    scene: Scene,
    columns: tuple[tuple[str, NDArray[np.bool_]], ...],
    actual: NDArray[np.bool_] | None,
) -> str:
    """The holes from above, one map per belief; wrong ones stand out where the truth is known."""
    with matplotlib.rc_context(FIGURE_STYLE):
        figure = Figure(figsize=(3.3 * len(columns), 3.5))
        axes = figure.subplots(1, len(columns), squeeze=False)[0]
        for axis, (title, held) in zip(axes, columns, strict=True):
            _attachment_map(axis, scene, held, actual)
            axis.set_title(title, fontsize=10, color=css(palette.INK), pad=6)
        figure.tight_layout()
        return svg_text(figure, "Attachments seen from above")


def png_uri(picture: NDArray[np.uint8]) -> str:
    """``data:`` address of a picture (h, w, 3)."""
    buffer = BytesIO()
    Image.fromarray(picture).save(buffer, format="PNG", optimize=True)
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode()


def depth_picture(depth_m: Floats) -> NDArray[np.uint8]:
    """Depth (h, w) in colours, near is bright; white where nothing was hit."""
    known = np.isfinite(depth_m)
    near_m, far_m = np.percentile(depth_m[known], [1, 99]) if known.any() else (0.0, 1.0)
    share = np.clip((far_m - np.where(known, depth_m, far_m)) / max(far_m - near_m, 1e-9), 0, 1)
    rgb = matplotlib.colormaps["viridis"](share)[..., :3]
    return np.where(known[..., None], 255 * rgb, 255).astype(np.uint8)


def _strip(axis: Axes, spans: tuple[Span, ...], colours: dict[str, str], name: str) -> None:
    """Coloured bars with their names where they fit."""
    begin_s, end_s = axis.get_xlim()
    for span in spans:
        width_s = span.end_s - span.begin_s
        colour = colours.get(span.name, css(palette.MUTED))
        axis.add_patch(Rectangle((span.begin_s, 0), width_s, 1, color=colour, linewidth=0))
        if width_s > (end_s - begin_s) * (0.009 * len(span.name) + 0.006):
            middle_s = span.begin_s + width_s / 2
            axis.text(
                middle_s, 0.46, span.name, ha="center", va="center", fontsize=8.5, color="white"
            )
    axis.set_ylim(0, 1)
    axis.set_yticks([])
    axis.grid(visible=False)
    axis.tick_params(bottom=False)
    for spine in axis.spines.values():
        spine.set_visible(False)
    axis.set_ylabel(name, rotation=0, ha="right", va="center")


def _discrepancy(axis: Axes, log: RunLog, time_s: Floats) -> None:
    deltas_mm = [1000 * delta_m for delta_m in log.info.scene.thresholds.delta_m]
    largest = 0.0
    for metric, colour in zip(log.metrics, _METRIC_COLOURS, strict=False):
        mu_mm = 1000 * log.column(f"mu_{metric}_m")
        acts = metric == log.metric
        label = f"{metric} (the tree acts on it)" if acts else metric
        axis.plot(time_s, mu_mm, color=css(colour), linewidth=1.7 if acts else 1.1, label=label)
        largest = max(largest, float(np.nanmax(mu_mm, initial=0.0)))
    top_mm = 1.32 * max(largest, deltas_mm[-1])
    # Three names need room; a curve far above the limits leaves it for one.
    crowded = deltas_mm[1] - deltas_mm[0] < 0.09 * top_mm
    names = ("", "delta1-3", "") if crowded else ("delta1", "delta2", "delta3")
    for name, delta_mm, colour in zip(names, deltas_mm, palette.WARNING_STATES[1:], strict=True):
        _limit(axis, delta_mm, css(colour), name)
    axis.set_ylim(0, top_mm)
    axis.set_ylabel("discrepancy\nmu [mm]")
    if log.metrics:
        axis.legend(loc="upper left", ncols=3)


def _force(axis: Axes, log: RunLog, time_s: Floats) -> None:
    epsilon_n = log.info.force_threshold_n
    force_n, true_n = log.column("force_n"), log.column("true_force_n")
    axis.plot(time_s, force_n, color=css(palette.ESTIMATED), linewidth=1.7, label="estimated")
    if np.isfinite(true_n).any():
        axis.plot(time_s, true_n, color=css(palette.INK), linewidth=1.0, label="true")
    over = np.nan_to_num(force_n) > epsilon_n
    axis.fill_between(
        time_s, epsilon_n, force_n, where=over, color=css(palette.WARNING_STATES[3]), alpha=0.25
    )
    _limit(axis, epsilon_n, css(palette.WARNING_STATES[3]), "epsilon")
    known = [float(np.nanmax(values, initial=0.0)) for values in (force_n, true_n)]
    axis.set_ylim(0, 1.32 * max(epsilon_n, *known))
    axis.set_ylabel("grasp force\nF [N]")
    axis.legend(loc="upper left", ncols=2)


def _rate(axis: Axes, log: RunLog, time_s: Floats) -> None:
    rate, seen = 100 * log.column("rate"), 100 * log.column("visibility")
    axis.step(
        time_s, rate, where="post", color=css(palette.ARMS["psm1"]), linewidth=1.3, label="rate"
    )
    axis.plot(time_s, seen, color=css(palette.ROI), linewidth=1.7, label="region visible")
    _limit(axis, 100 * log.info.scene.thresholds.roi_visibility, css(palette.ROI), "goal")
    axis.set_ylim(-4, 145)
    axis.set_yticks([0, 50, 100])
    axis.set_ylabel("rate, visible\n[%]")
    axis.legend(loc="upper left", ncols=2)


def _limit(axis: Axes, value: float, colour: str, name: str) -> None:
    axis.axhline(value, color=colour, linewidth=1.0, linestyle=(0, (4, 3)))
    axis.annotate(
        name,
        (1.0, value),
        xycoords=axis.get_yaxis_transform(),
        xytext=(4, 0),
        textcoords="offset points",
        va="center",
        fontsize=8.5,
        color=colour,
        annotation_clip=False,
    )


def _attachment_map(
    axis: Axes, scene: Scene, held: NDArray[np.bool_], actual: NDArray[np.bool_] | None
) -> None:
    outline = 1000 * scene.tissue.shape.outline_m
    axis.add_patch(Polygon(outline, facecolor="#fbf1ef", edgecolor=css(palette.TISSUE)))
    roi_mm = 1000 * scene.roi_center_m[:2]
    axis.add_patch(
        Circle(
            (roi_mm[0], roi_mm[1]),
            1000 * scene.roi.radius_m,
            color=css(palette.ROI),
            alpha=0.45,
            lw=0,
        )
    )
    x, y = 1000 * scene.holes_xy_m.T
    axis.scatter(x[scene.is_hole], y[scene.is_hole], s=5, color="#c9ced4", zorder=2)
    wrong = np.zeros(len(held), bool) if actual is None else held & ~actual
    missed = np.zeros(len(held), bool) if actual is None else actual & ~held
    right = held & ~wrong
    axis.scatter(x[right], y[right], s=52, color=css(palette.BELIEVED), zorder=3)
    axis.scatter(
        x[wrong],
        y[wrong],
        s=46,
        facecolor="none",
        edgecolor=css(palette.BELIEVED),
        linewidth=1.6,
        zorder=3,
    )
    axis.scatter(
        x[missed], y[missed], s=46, marker="x", color=css(palette.ACTUAL), linewidth=2.0, zorder=3
    )
    margin = 4
    axis.set_xlim(outline[:, 0].min() - margin, outline[:, 0].max() + margin)
    axis.set_ylim(outline[:, 1].min() - margin, outline[:, 1].max() + margin)
    axis.set_aspect("equal")
    axis.axis("off")
