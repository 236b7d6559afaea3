"""Measured and predicted curves that people know how to read, as force over stretch."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib
from matplotlib.figure import Figure

from defras_bt.diagnosis.exhibits import Comparison
from defras_bt.diagnosis.report_words import unit_shown
from defras_bt.recording import palette
from defras_bt.recording.figures import FIGURE_STYLE, svg_text
from defras_bt.recording.palette import css

MOST_CURVES = 9
_COLUMNS = 3


def curves_svg(comparisons: Sequence[Comparison], *, extended: bool) -> str:
    """A small figure each: measured in black, both models in colour."""
    shown = comparisons[:MOST_CURVES]
    count = min(_COLUMNS, len(shown))
    lines = -(-len(shown) // count)
    with matplotlib.rc_context(FIGURE_STYLE):
        figure = Figure(figsize=(10.2, 2.9 * lines), layout="constrained")
        axes = figure.subplots(lines, count, squeeze=False).ravel()
        for axis, each in zip(axes, shown, strict=False):
            (fx, x_unit), (fy, y_unit) = unit_shown(each.x_unit), unit_shown(each.y_unit)
            x = fx * each.x
            axis.plot(
                x, fy * each.measured, color=css(palette.INK), linewidth=1.8, label="measured"
            )
            axis.plot(x, fy * each.plain, color="#c24a3a", linewidth=1.2, label="as it was")
            if extended:
                axis.plot(
                    x,
                    fy * each.extended,
                    color=css(palette.ESTIMATED),
                    linewidth=1.2,
                    label="extended",
                )
            axis.set_title(each.name, fontsize=9.5, color=css(palette.INK))
            axis.set_xlabel(f"{each.x_name} [{x_unit or '1'}]")
            axis.set_ylabel(f"{each.y_name} [{y_unit or '1'}]")
        for axis in axes[len(shown) :]:
            axis.axis("off")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=3)
        return svg_text(figure, "Measured and predicted")
