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
    """Mean residual per phase and place of one ``face`` of the tissue.

    ``means_mm`` (phases, places); NaN: nothing was seen.
    """

    face: str
    phases: tuple[str, ...]
    places_mm: Floats
    means_mm: Floats


def placed_means(samples: Samples, residual: Floats) -> tuple[PlacedMeans, ...]:
    """Means over all trajectories, of the channels that have a place and measure lengths.

    Channels whose names differ in the last word only ("upper 1,1", "upper 1,2") are of one face.
    Phases in which nothing was seen of any are left out.
    """
    faces: dict[str, list[int]] = {}
    for i, channel in enumerate(samples.channels):
        if channel.place_m is not None and channel.unit == "m":
            faces.setdefault(channel.name.rpartition(" ")[0], []).append(i)
    tables = {face: _means_mm(samples, residual, members) for face, members in faces.items()}
    if not tables:
        return ()
    seen = np.any([np.isfinite(table).any(axis=1) for table in tables.values()], axis=0)
    shown = np.flatnonzero(seen)[:_MOST_PHASES]
    return tuple(
        PlacedMeans(
            face,
            tuple(samples.phases[i] for i in shown),
            _MM * np.array([samples.channels[i].place_m for i in faces[face]], float),
            table[shown],
        )
        for face, table in tables.items()
        if np.isfinite(table).any()
    )


def _means_mm(samples: Samples, residual: Floats, members: list[int]) -> Floats:
    """Mean (phases, members) of the residual of channels in each phase."""
    count = len(samples.phases)
    column = np.full(len(samples.channels), -1)
    column[members] = np.arange(len(members))
    chosen = np.isfinite(residual) & (column[samples.channel] >= 0)
    at = samples.phase[chosen] * len(members) + column[samples.channel[chosen]]
    size = count * len(members)
    number = np.bincount(at, minlength=size).astype(float)
    number[number == 0] = np.nan
    total = np.bincount(at, residual[chosen], minlength=size)
    return np.asarray(_MM * total / number).reshape(count, len(members))


def has_places(diagnosis: Diagnosis) -> bool:
    """Whether anything can be drawn on a tissue."""
    return bool(placed_means(diagnosis.samples, diagnosis.held_out_before))


def tissue_maps_svg(diagnosis: Diagnosis, scene: Scene, *, extended: bool) -> str:
    """One column per phase; for each face the plain model and, with ``extended``, that one below.

    Positive where tissue was seen outside of the simulated one.
    """
    before = placed_means(diagnosis.samples, diagnosis.held_out_before)
    after = placed_means(diagnosis.samples, diagnosis.held_out_after)
    rows = []
    for index, found in enumerate(before):
        face = f"{found.face}, " if len(before) > 1 else ""
        rows.append((f"{face}as it was", found))
        if extended:
            rows.append((f"{face}extended", after[index]))
    phases = before[0].phases
    everything = np.abs(np.concatenate([found.means_mm.ravel() for found in before]))
    scale_mm = max(_LEAST_SCALE_MM, float(np.nanpercentile(everything, 98)))
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
            bar.set_label("seen outside (+) [mm]", fontsize=8)
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
