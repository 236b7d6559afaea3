"""How the figures of all reports look, and how they get into a page."""

from __future__ import annotations

import re
from io import BytesIO
from typing import Any

from matplotlib.figure import Figure

from defras_bt.recording import palette
from defras_bt.recording.palette import css

FIGURE_STYLE: Any = {
    # Text stays text: it takes the page's font and can be searched.
    "svg.fonttype": "none",
    "svg.hashsalt": "defras",
    "font.family": "sans-serif",
    "font.size": 9.0,
    "axes.edgecolor": "#c3c9d0",
    "axes.labelcolor": css(palette.INK),
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e8ebee",
    "grid.linewidth": 0.8,
    "xtick.color": "#5c6672",
    "ytick.color": "#5c6672",
    "legend.frameon": False,
    "legend.fontsize": 8.5,
}


def svg_text(figure: Figure, title: str) -> str:
    """``figure`` as an SVG element that is as wide as the page lets it."""
    buffer = BytesIO()
    figure.savefig(
        buffer, format="svg", bbox_inches="tight", metadata={"Date": None, "Title": title}
    )
    text = buffer.getvalue().decode()
    text = text[text.index("<svg") :]
    # The page's style sheet sizes the figure.
    return re.sub(r'(<svg[^>]*?) width="[^"]*" height="[^"]*"', r"\1", text, count=1)
