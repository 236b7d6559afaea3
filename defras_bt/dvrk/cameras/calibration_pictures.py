"""Pictures of what a calibration takes for tissue and for the region, and what it leaves out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from defras_bt.dvrk.camera_settings import Colours
from defras_bt.dvrk.cameras.calibration_data import CameraView
from defras_bt.dvrk.cameras.tissue_cloud import taken_points
from defras_bt.sensing.cloud import decimate_m
from defras_sim.geometry import Floats

_DIMMED = 0.35
_TISSUE, _ROI = (255, 160, 60), (60, 220, 110)
_MOST_DRAWN = 4000


def draw_view(view: CameraView, colours: Colours, voxel_m: float, file: Path) -> str:
    """Draw one view into ``file``; returns in a sentence what was taken.

    Raises:
        OSError: the file cannot be written.
    """
    rgb = view.rgb
    if rgb is None and view.cloud is not None and view.cloud.is_picture:
        rgb = view.cloud.rgb
    panels = (0 if rgb is None else 2) + (0 if view.cloud is None else 2)
    figure = Figure(figsize=(4.2 * panels, 4.0), layout="constrained")
    axes = list(np.atleast_1d(figure.subplots(1, panels)))
    told = []
    if rgb is not None:
        told.append(_draw_picture(axes[:2], rgb, colours))
        axes = axes[2:]
    if view.cloud is not None:
        taken = taken_points(view.cloud, colours.calibration)
        told.append(_draw_cloud(axes, view.cloud.points, taken, voxel_m))
    figure.suptitle(view.source)
    figure.savefig(file, dpi=110)
    return f"{view.source}: {'; '.join(told)}"


def _draw_picture(axes: list[Axes], rgb: NDArray[np.uint8], colours: Colours) -> str:
    tissue = colours.calibration.tissue.mask(rgb)
    roi = colours.calibration.roi.mask(rgb)
    shown = (_DIMMED * rgb).astype(np.uint8)
    for mask, colour in ((tissue, _TISSUE), (roi, _ROI)):
        shown[mask] = (0.5 * rgb[mask] + 0.5 * np.array(colour)).astype(np.uint8)
    axes[0].imshow(rgb)
    axes[0].set_title("as seen (column, row)")
    axes[1].imshow(shown)
    axes[1].set_title("orange: tissue, green: region")
    both = int((tissue & roi).sum())
    clash = f", {both} pixels taken for both" if both else ""
    return f"{tissue.mean():.1%} of the picture is tissue, {roi.mean():.1%} region{clash}"


def _draw_cloud(axes: list[Axes], points: Floats, taken: NDArray[np.bool_], voxel_m: float) -> str:
    measured = np.isfinite(points[..., 2])
    kept = decimate_m(points[taken], voxel_m)
    left_out = points[measured & ~taken]
    thinned = left_out[:: max(1, len(left_out) // _MOST_DRAWN)]
    for axis, (across, up) in zip(axes, ((0, 1), (0, 2)), strict=True):
        axis.scatter(thinned[:, across], thinned[:, up], s=1, c="0.75", label="left out")
        axis.scatter(kept[:, across], kept[:, up], s=2, c="tab:orange", label="tissue, decimated")
        axis.set_xlabel(f"{'xyz'[across]} (m)")
        axis.set_ylabel(f"{'xyz'[up]} (m)")
        axis.set_aspect("equal")
    axes[0].legend(loc="upper right", markerscale=4)
    return (
        f"{int(measured.sum())} points, {int(taken.sum())} of them tissue, {len(kept)} after "
        f"decimation to {1e3 * voxel_m:g} mm"
    )
