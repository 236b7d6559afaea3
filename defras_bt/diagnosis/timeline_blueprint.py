"""How the rerun viewer shows a diagnosis when nobody has arranged it otherwise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import rerun.blueprint as rrb
from rerun.blueprint import archetypes
from rerun.blueprint.components import LinkAxis

from defras_bt.recording.timeline_blueprint import PLOT_BACKGROUND, field_view

APPLICATION = "defras_diagnosis"

_MOST_PLOTS = 6


@dataclass(frozen=True)
class Plot:
    """Residuals of one sensor: ``place`` under ``residual/``, and what the axis shows."""

    place: str
    title: str
    low: float
    high: float


def blueprint(plots: Sequence[Plot], *, replay: bool, extended: bool) -> rrb.Blueprint:
    """Both models beside what was seen on the left; verdict, phases and residuals on the right."""
    plotted = plots[:_MOST_PLOTS]
    right = rrb.Vertical(
        rrb.TextDocumentView(origin="/verdict", contents=["/verdict"], name="Verdict"),
        rrb.StateTimelineView(origin="/motion", name="Motion"),
        *(_plot(each) for each in plotted),
        row_shares=[1.8, 1.3, *[1.5] * len(plotted)],
    )
    fields = [_field("Simulation as it was, and what was seen", "plain")]
    if extended:
        fields.append(_field("Extended simulation, and what was seen", "extended"))
    return rrb.Blueprint(
        rrb.Horizontal(rrb.Vertical(*fields), right, column_shares=[5, 4]) if replay else right,
        rrb.TimePanel(timeline="time", state="collapsed"),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        rrb.TopPanel(state="hidden"),
        auto_layout=False,
        auto_views=False,
    )


def _field(name: str, model: str) -> rrb.Spatial3DView:
    return field_view(
        name,
        [
            "/world/bed",
            "/world/roi/**",
            "/world/attachments/**",
            "/world/psm1",
            "/world/psm2",
            f"/world/tissue/{model}",
            f"/world/tissue/observed_{model}",
        ],
    )


def _plot(plot: Plot) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(
        origin=f"/residual/{plot.place}",
        contents=[f"/residual/{plot.place}/**"],
        name=plot.title,
        background=archetypes.PlotBackground(color=PLOT_BACKGROUND, show_grid=True),
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.LeftTop),
        axis_y=rrb.ScalarAxis(range=(plot.low, plot.high)),
        axis_x=rrb.TimeAxis(link=LinkAxis.LinkToGlobal),
    )
