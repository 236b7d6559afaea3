"""The residual on the tissue, seen from above: one map per phase of the motion."""

from __future__ import annotations

from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle

from defras_bt.diagnosis.diagnosis import Diagnosis
from defras_bt.diagnosis.problem import Samples
from defras_bt.recording import palette
from defras_bt.recording.figures import FIGURE_STYLE, svg_text
from defras_bt.recording.palette import css
from defras_sim.geometry import Floats
from defras_sim.scene import Scene

_MM = 1000.0
_LEAST_SCALE_MM = 1.0
_MOST_PHASES = 6
_ABOVE_BELOW = LinearSegmentedColormap.from_list(
    "above_below", ["#1d4fa3", "#7fb0ea", "#f4f4f2", "#f0a35e", "#b3261e"]
)


@dataclass(frozen=True)
class PlacedMeans:
    """Mean residual per phase and place. ``means_mm`` (phases, places); NaN: nothing was seen."""

    phases: tuple[str, ...]
    places_mm: Floats
    means_mm: Floats


def placed_means(samples: Samples, residual: Floats) -> PlacedMeans:
    """Means over all trajectories, of the channels that have a place and measure lengths."""
    placed = [i for i, c in enumerate(samples.channels) if c.place_m is not None and c.unit == "m"]
    phases = [i for i in range(len(samples.phases)) if np.any(samples.phase == i)]
    means = np.full((len(phases), len(placed)), np.nan)
    for row, phase in enumerate(phases):
        for column, channel in enumerate(placed):
            seen = residual[(samples.channel == channel) & (samples.phase == phase)]
            seen = seen[np.isfinite(seen)]
            if len(seen):
                means[row, column] = _MM * float(seen.mean())
    shown = np.flatnonzero(np.isfinite(means).any(axis=1))[:_MOST_PHASES]
    places = np.array([samples.channels[i].place_m for i in placed], float).reshape(-1, 2)
    names = tuple(samples.phases[phases[i]] for i in shown)
    return PlacedMeans(names, _MM * places, means[shown])


def has_places(samples: Samples) -> bool:
    """Whether anything can be drawn on a tissue."""
    return any(c.place_m is not None and c.unit == "m" for c in samples.channels)


def tissue_maps_svg(diagnosis: Diagnosis, scene: Scene, *, extended: bool) -> str:
    """One column per phase; the plain model above and, with ``extended``, that one below."""
    rows = [("simulation as it was", placed_means(diagnosis.samples, diagnosis.held_out_before))]
    if extended:
        rows.append(
            ("extended simulation", placed_means(diagnosis.samples, diagnosis.held_out_after))
        )
    phases = rows[0][1].phases
    scale_mm = max(_LEAST_SCALE_MM, float(np.nanpercentile(np.abs(rows[0][1].means_mm), 98)))
    with matplotlib.rc_context(FIGURE_STYLE):
        figure = Figure(figsize=(1.9 * len(phases) + 1.1, 2.05 * len(rows) + 0.2))
        axes = figure.subplots(
            len(rows),
            len(phases) + 1,
            squeeze=False,
            width_ratios=[*[1.0] * len(phases), 0.055],
            gridspec_kw={"wspace": 0.05, "hspace": 0.06},
        )
        norm = Normalize(-scale_mm, scale_mm)
        for index, ((name, found), line) in enumerate(zip(rows, axes, strict=True)):
            for column, axis in enumerate(line[:-1]):
                _map(axis, scene, found.places_mm, found.means_mm[column], norm)
                if index == 0:
                    axis.set_title(phases[column], fontsize=10, color=css(palette.INK), pad=4)
            line[0].text(
                -0.06, 0.5, name, rotation=90, va="center", ha="right", transform=line[0].transAxes
            )
            shades = matplotlib.cm.ScalarMappable(norm, _ABOVE_BELOW)
            bar = figure.colorbar(shades, cax=line[-1])
            bar.outline.set_visible(False)
            bar.set_label("observed lies higher [mm]", fontsize=8)
            bar.ax.tick_params(labelsize=8, length=2)
        return svg_text(figure, "Difference between tissue and simulation, seen from above")


def _map(axis: Axes, scene: Scene, places_mm: Floats, means_mm: Floats, norm: Normalize) -> None:
    outline = _MM * scene.tissue.shape.outline_m
    border = Polygon(outline, facecolor="#eceef0", edgecolor="none")
    axis.add_patch(border)
    width_mm, height_mm = _pitch_mm(places_mm)
    for (x, y), mean in zip(places_mm, means_mm, strict=True):
        if np.isfinite(mean):
            cell = Rectangle(
                (x - width_mm / 2, y - height_mm / 2),
                width_mm,
                height_mm,
                facecolor=_ABOVE_BELOW(norm(mean)),
                edgecolor="white",
                linewidth=0.3,
            )
            axis.add_patch(cell)
            cell.set_clip_path(border)
    axis.add_patch(Polygon(outline, fill=False, edgecolor=css(palette.TISSUE), linewidth=1.0))
    held_mm = _MM * scene.holes_xy_m[scene.attached]
    axis.scatter(
        held_mm[:, 0],
        held_mm[:, 1],
        s=7,
        facecolor="none",
        edgecolor=css(palette.INK),
        linewidth=0.7,
    )
    center_mm = _MM * scene.roi_center_m[:2]
    axis.add_patch(
        Circle(
            (center_mm[0], center_mm[1]),
            _MM * scene.roi.radius_m,
            fill=False,
            edgecolor=css(palette.ROI),
            linewidth=1.4,
        )
    )
    axis.set_xlim(outline[:, 0].min() - 2, outline[:, 0].max() + 2)
    axis.set_ylim(outline[:, 1].min() - 2, outline[:, 1].max() + 2)
    axis.set_aspect("equal")
    axis.axis("off")


def _pitch_mm(places_mm: Floats) -> tuple[float, float]:
    """Width and height of a cell: the smallest step between two places along each axis."""
    return _step(places_mm[:, 0]), _step(places_mm[:, 1])


def _step(values: Floats) -> float:
    gaps = np.diff(np.unique(np.round(values, 3)))
    return float(gaps.min()) if len(gaps) else 10.0
