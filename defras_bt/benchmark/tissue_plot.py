"""The picture of the tissue benchmark: how wrong, how slow, and how both grow."""

from __future__ import annotations

import io
from collections.abc import Sequence

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from defras_bt.benchmark.tissue import OWN, Case, Growth
from defras_bt.benchmark.tissue_motions import CHECKPOINT_M
from defras_bt.benchmark.tissue_reference import reference

_COLOURS = {
    "defras": "#186a3b",
    "felupe": "#1f618d",
    "PyBullet": "#b9770e",
    "MuJoCo flex": "#922b21",
}
_GREY = "#566573"
_FRAME_MS = 16.0


def tissue_figure(cases: Sequence[Case], sizes: Sequence[Growth]) -> str:
    """Three panels as SVG: forces on the way, error against time, time against the mesh."""
    with plt.rc_context({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False}):
        figure, (forces, balance, growing) = plt.subplots(1, 3, figsize=(12.5, 4.0))
        _forces(forces, cases)
        _error_against_time(balance, cases)
        _growth(growing, sizes)
        figure.tight_layout()
        buffer = io.StringIO()
        figure.savefig(buffer, format="svg")
        plt.close(figure)
    svg = buffer.getvalue()
    return svg[svg.index("<svg") :]


def _forces(axes: Axes, cases: Sequence[Case]) -> None:
    """Force along the motion on which most models ran, neo-Hookean."""
    shown = [case for case in cases if case.material == "neo_hookean"]
    motion = next((case.motion for case in shown if case.motion.name == "off_centre_lift"), None)
    if motion is None:
        return
    right = np.linalg.norm(reference(motion.name, "neo_hookean").forces_n, axis=1)
    way_mm = 1e3 * CHECKPOINT_M * np.arange(1, len(right) + 1)
    axes.plot(way_mm, right, color=_GREY, lw=5, alpha=0.35, label="converged")
    for case in shown:
        if case.motion is motion and len(case.forces_n):
            size = np.linalg.norm(case.forces_n, axis=1)
            axes.plot(
                way_mm[: len(size)], size, "o-", ms=3, color=_COLOURS[case.kind], label=case.model
            )
    axes.set(xlabel="lift [mm]", ylabel="force at the jaw [N]", title=motion.title)
    axes.set_ylim(0, 3 * right.max())
    axes.legend(frameon=False)


def _error_against_time(axes: Axes, cases: Sequence[Case]) -> None:
    """Every case as a point; below 5 % and left of real time is where a guard can use it."""
    named = set()
    for case in cases:
        ratios = case.force_ratio[np.isfinite(case.force_ratio)]
        if not len(ratios):
            continue
        label = None if case.kind in named else case.kind
        named.add(case.kind)
        error = 100 * float(np.median(np.abs(ratios - 1)))
        axes.plot(
            case.computing_per_simulated_s,
            error,
            "o",
            color=_COLOURS[case.kind],
            alpha=0.8,
            label=label,
        )
    axes.set(xscale="log", yscale="log")
    axes.axhline(5, color=_GREY, lw=0.8, ls="--")
    axes.axvline(1, color=_GREY, lw=0.8, ls="--")
    _note(axes, "5 %", (0.0, 5), ("axes fraction", "data"))
    _note(axes, "real time", (1, 0.0), ("data", "axes fraction"))
    axes.set(
        xlabel="computing per simulated second [s]",
        ylabel="median error of the force [%]",
        title="Error and time, every motion",
    )
    _legend(axes)


def _growth(axes: Axes, sizes: Sequence[Growth]) -> None:
    for kind in dict.fromkeys(size.kind for size in sizes):
        mine = [size for size in sizes if size.kind == kind]
        x, y = [s.unknowns for s in mine], [1e3 * s.frame_s for s in mine]
        axes.plot(x, y, "o-", ms=4, color=_COLOURS[kind], label=kind)
        for size, across, up in zip(mine, x, y, strict=True):
            if kind == OWN:
                text = "x".join(map(str, size.cells_xyz))
                axes.annotate(text, (across, up), (3, -9), textcoords="offset points", fontsize=7)
    axes.axhline(_FRAME_MS, color=_GREY, lw=0.8, ls="--")
    _note(axes, "a frame", (0.0, _FRAME_MS), ("axes fraction", "data"))
    axes.set(xscale="log", yscale="log", xlabel="unknowns", ylabel="computing for 1 mm [ms]")
    axes.set_title("Growth with the mesh")
    _legend(axes)


def _note(axes: Axes, text: str, at: tuple[float, float], system: tuple[str, str]) -> None:
    """A word beside a line."""
    axes.annotate(text, at, (4, 3), xycoords=system, textcoords="offset points", color=_GREY)


def _legend(axes: Axes) -> None:
    if axes.get_legend_handles_labels()[0]:
        axes.legend(frameon=False)
