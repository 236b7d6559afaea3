"""How the rerun viewer shows a run when nobody has arranged it otherwise."""

from __future__ import annotations

from collections.abc import Sequence

import rerun.blueprint as rrb
from rerun.blueprint import archetypes
from rerun.blueprint.components import LinkAxis
from rerun.blueprint.encodings import TextLogColumn, TextLogColumnKind, TimelineColumn

APPLICATION = "defras"

# The viewer's own theme is dark; views of another brightness would glare.
BACKGROUND = (24, 27, 31)
PLOT_BACKGROUND = (13, 15, 18)


def field_view(name: str, contents: Sequence[str] = ("$origin/**",)) -> rrb.Spatial3DView:
    """The operating field from obliquely above, with what stands at ``contents`` of the tree."""
    return rrb.Spatial3DView(
        origin="/world",
        contents=list(contents),
        name=name,
        background=BACKGROUND,
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=(-0.11, -0.17, 0.125),
            look_target=(0.0, 0.0, 0.02),
            eye_up=(0.0, 0.0, 1.0),
        ),
    )


def default_blueprint(*, truth_known: bool, pictures: bool) -> rrb.Blueprint:
    """Scene, endoscope and plan on the left; lanes, signals and log on the right.

    ``truth_known``: the recording holds the actual tissue. ``pictures``: it holds the endoscope's
    picture; without one, the scene is drawn as the endoscope would see it.
    """
    scene = field_view("Operating field")
    drawn = [
        "/world/bed",
        "/world/roi/**",
        "/world/tissue/actual" if truth_known else "/world/tissue/simulated",
        "/world/psm1/**",
        "/world/psm2/**",
    ]
    endoscope = rrb.Spatial2DView(
        origin="/world/endoscope",
        contents=["/world/endoscope/**", *([] if pictures else drawn)],
        name="Endoscope" if pictures else "Endoscope (drawn)",
        background=BACKGROUND,
    )
    attachments = rrb.Spatial2DView(
        origin="/map",
        name="Attachments, from above",
        background=BACKGROUND,
        visual_bounds=rrb.VisualBounds2D(x_range=(-70, 70), y_range=(-70, 70)),
    )
    plan = rrb.TextDocumentView(origin="/plan", contents=["/plan"], name="Plan")
    tree = rrb.GraphView(
        origin="/tree",
        name="Behaviour tree",
        background=archetypes.GraphBackground(color=BACKGROUND),
        # The nodes stand where the recording puts them.
        force_link=archetypes.ForceLink(enabled=False),
        force_many_body=archetypes.ForceManyBody(enabled=False),
        force_position=archetypes.ForcePosition(enabled=False),
        force_center=archetypes.ForceCenter(enabled=False),
        force_collision_radius=archetypes.ForceCollisionRadius(enabled=False),
    )
    left = rrb.Vertical(
        scene,
        rrb.Horizontal(endoscope, attachments, rrb.Tabs(plan, tree), column_shares=[3, 2, 3]),
        row_shares=[3, 2],
    )
    right = rrb.Vertical(
        rrb.StateTimelineView(
            origin="/",
            contents=["/operator/mode", "/monitor/**", "/plan/action"],
            name="Operator, warnings, actions",
        ),
        rrb.StateTimelineView(origin="/executive", name="Nodes of the behaviour tree"),
        _plot("Discrepancy mu [mm]", "mu_mm"),
        _plot("Grasp force [N]", "force_n"),
        _plot("Rate, and share of the region that is visible", "rate", "visibility"),
        rrb.TextLogView(
            origin="/log",
            name="Log",
            columns=archetypes.TextLogColumns(
                timeline_columns=[TimelineColumn("sim_time", visible=True)],
                text_log_columns=[
                    TextLogColumn(TextLogColumnKind.LogLevel, visible=True),
                    TextLogColumn(TextLogColumnKind.Body, visible=True),
                ],
            ),
        ),
        row_shares=[2.9, 3.2, 1.8, 1.8, 1.5, 1.9],
    )
    return rrb.Blueprint(
        rrb.Horizontal(left, right, column_shares=[5, 4]),
        rrb.TimePanel(timeline="sim_time", state="collapsed"),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        rrb.TopPanel(state="hidden"),
        auto_layout=False,
        auto_views=False,
    )


def _plot(name: str, *signals: str) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(
        origin="/signals",
        contents=[f"/signals/{signal}/**" for signal in signals],
        name=name,
        background=archetypes.PlotBackground(color=PLOT_BACKGROUND, show_grid=True),
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.LeftTop),
        axis_x=rrb.TimeAxis(link=LinkAxis.LinkToGlobal),
    )
