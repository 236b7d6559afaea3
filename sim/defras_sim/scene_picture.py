"""A picture of a scene: what holds the tissue, where the region lies, who grasps where."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D

from defras_sim.geometry import Floats
from defras_sim.scene import Camera, Scene

TISSUE = "#f2c9c2"
HELD = "#444444"
MISSING = "#1f6fd1"
EXTRA = "#c1272d"
REGION = "#2f9e44"
ARM_COLOURS = {"psm1": "#7a4fbf", "psm2": "#b8860b"}


def draw_scene(scene: Scene, file: Path, actual: Scene | None = None) -> None:
    """Write a PNG with a top view and a 3-D view; with ``actual``, belief and truth compared."""
    figure = Figure(figsize=(14, 7.4), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    top, space = figure.subplots(1, 2, width_ratios=[1.12, 1])
    _draw_top(top, scene, actual)
    space.remove()
    _draw_space(figure.add_subplot(1, 2, 2, projection="3d"), scene, actual or scene)
    title = scene.name if actual is None else f"{scene.name}, believed; {actual.name}, actual"
    figure.suptitle(title, fontsize=15)
    figure.savefig(file)


def _draw_top(axes: Axes, scene: Scene, actual: Scene | None) -> None:
    length, width = 1e3 * scene.tissue.length_x_m, 1e3 * scene.tissue.width_y_m
    outline = 1e3 * scene.tissue.shape.outline_m
    axes.add_patch(Polygon(outline, fc=TISSUE, ec="#8a5a52", lw=1.5))
    _draw_holes(axes, scene, actual)
    center = 1e3 * scene.roi_center_m[:2]
    radius = 1e3 * scene.roi.radius_m
    axes.add_patch(Circle((center[0], center[1]), radius, fc=REGION, alpha=0.3, zorder=3))
    axes.add_patch(Circle((center[0], center[1]), radius, fill=False, ec=REGION, lw=2, zorder=3))
    _draw_grasp_points(axes, scene)
    reach = max(length, width) / 2 + 26
    axes.axhline(0, color="#888888", lw=1, ls="--", zorder=1)
    for arm, part in scene.arms.items():
        side = 1 if part.side == "+y" else -1
        where = (0, side * (width / 2 + 7))
        axes.annotate(
            f"{arm} works on this side", where, ha="center", va="center", color=ARM_COLOURS[arm]
        )
    for name, camera in (("endoscope", scene.endoscope), ("depth camera", scene.depth_camera)):
        _draw_direction(axes, name, camera, reach)
    axes.plot([-length / 2, -length / 2 + 20], [-reach + 6] * 2, color="black", lw=3)
    axes.annotate("20 mm", (-length / 2 + 10, -reach + 8.5), ha="center")
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), xlabel="x [mm]", ylabel="y [mm]")
    axes.set_aspect("equal")
    _draw_legend(axes, actual is not None)


def _draw_holes(axes: Axes, scene: Scene, actual: Scene | None) -> None:
    radius = 1e3 * scene.attachments.hole_radius_m
    true = scene.attached if actual is None else actual.attached
    there = scene.is_hole
    places = 1e3 * scene.holes_xy_m[there]
    for (x, y), believed, holds in zip(places, scene.attached[there], true[there], strict=True):
        if not (believed or holds):
            axes.add_patch(Circle((x, y), 0.25 * radius, fc="#c79a92", ec="none"))
            continue
        colour = HELD if believed and holds else MISSING if believed else EXTRA
        filled = colour if holds else "none"
        axes.add_patch(Circle((x, y), radius, fc=filled, ec=colour, lw=1.8))


def _draw_grasp_points(axes: Axes, scene: Scene) -> None:
    for column, row in scene.grasp_points:
        x, y = 1e3 * scene.grasp_xy_m(column, row)
        arms = scene.arms_at(column, row)
        colour = ARM_COLOURS[arms[0]] if len(arms) == 1 else "black"
        axes.plot(x, y, "+", color=colour, ms=9, mew=2, zorder=4)
        axes.annotate(
            f"{column},{row}",
            (x, y),
            xytext=(4, 4),
            textcoords="offset points",
            fontsize=8.5,
            color=colour,
            bbox={"fc": "white", "ec": "none", "alpha": 0.6, "pad": 0.5},
            zorder=4,
        )


def _draw_direction(axes: Axes, name: str, camera: Camera, reach: float) -> None:
    position, target = np.array(camera.position_m[:2]), np.array(camera.target_m[:2])
    towards = (target - position) / np.linalg.norm(target - position)
    start = -towards * (reach - 4)
    stop = start + towards * 16
    arrow = {"arrowstyle": "-|>", "lw": 2.5, "color": "#333333"}
    axes.annotate("", (stop[0], stop[1]), (start[0], start[1]), arrowprops=arrow)
    beside = start + np.array([-towards[1], towards[0]]) * 5 + towards * 8
    axes.annotate(name, (beside[0], beside[1]), ha="center", va="center", fontsize=9)


def _draw_legend(axes: Axes, compared: bool) -> None:
    def dot(colour: str, filled: bool, label: str) -> None:
        face = colour if filled else "none"
        axes.plot([], [], "o", mfc=face, mec=colour, mew=1.8, ms=9, ls="", label=label)

    if compared:
        dot(HELD, True, "holds, as believed")
        dot(MISSING, False, "believed to hold, is free")
        dot(EXTRA, True, "holds, believed free")
    else:
        dot(HELD, True, "holds")
    axes.plot([], [], "o", color=REGION, alpha=0.5, ms=13, ls="", label="hidden region")
    axes.plot([], [], "+", color="black", ms=9, mew=2, ls="", label="grasp point (column,row)")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.09), ncols=3, frameon=False)


def _draw_space(axes: Axes3D, scene: Scene, true: Scene) -> None:
    for face, alpha in zip(_faces(scene), (0.45, 0.2), strict=True):
        many = len(face) > 1  # small triangles: their shade shows the shape, edges would hide it
        edge = {"linewidths": 0.0} if many else {"edgecolors": "#8a5a52"}
        axes.add_collection3d(
            Poly3DCollection(face, facecolors=TISSUE, alpha=alpha, shade=many, **edge)
        )
    for x, y, z in 1e3 * true.holes_m[true.attached]:
        axes.plot([x, x], [y, y], [z - 8, z], color=HELD, lw=3)
    rim = _rim(scene)
    axes.add_collection3d(Poly3DCollection([rim.tolist()], fc=REGION, ec=REGION, alpha=0.7))
    target = 1e3 * scene.roi_center_m
    for name, camera in (("endoscope", scene.endoscope), ("depth camera", scene.depth_camera)):
        eye = 1e3 * np.array(camera.position_m)
        aim = target if name == "endoscope" else 1e3 * np.array(camera.target_m)
        axes.plot(*np.stack([eye, aim]).T, color="#333333", lw=1.2, ls=":")
        axes.scatter(*eye, color="#333333", s=45, marker="s")
        axes.text(eye[0], eye[1], eye[2] + 12, name, ha="center")
    for arm, part in scene.arms.items():
        line = 1e3 * np.array([part.rcm_m, part.home_tip_m])
        axes.plot(*line.T, color=ARM_COLOURS[arm], lw=3)
        axes.scatter(*line[0], color=ARM_COLOURS[arm], s=45)
        axes.text(line[0, 0], line[0, 1], line[0, 2] + 12, arm, color=ARM_COLOURS[arm], ha="center")
    axes.set(xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]")
    axes.set_aspect("equal")
    axes.set_box_aspect(None, zoom=1.05)
    axes.view_init(elev=24, azim=-115)


def _rim(scene: Scene) -> Floats:
    """The region's border (n, 3) [mm]."""
    angle = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    return 1e3 * scene.under_tissue_m(scene.roi_center_m[:2] + scene.roi.radius_m * circle)


def _faces(scene: Scene) -> tuple[list[Floats], list[Floats]]:
    """Polygons (k, 3) [mm] of the upper face and of the lower one."""
    anatomy, shape = scene.tissue.anatomy, scene.tissue.shape
    if anatomy is None:
        upper, lower = (1e3 * face.at(shape.outline_m) for face in (shape.upper, shape.lower))
        return [upper], [lower]
    corners = 1e3 * anatomy.vertices_m[anatomy.triangles]
    return list(corners[anatomy.side == 1]), list(corners[anatomy.side == -1])
