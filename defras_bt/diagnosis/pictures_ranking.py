"""What each candidate cause would explain, and which cannot be told apart."""

from __future__ import annotations

import matplotlib
import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from defras_bt.diagnosis.diagnosis import Confounding, Diagnosis
from defras_bt.diagnosis.report_words import key_words
from defras_bt.recording import palette
from defras_bt.recording.figures import FIGURE_STYLE, svg_text
from defras_bt.recording.palette import css

MOST_CANDIDATES = 16
_NAMED, _OTHER = css(palette.ESTIMATED), "#b9c3cf"
_LIKE = LinearSegmentedColormap.from_list("like", ["#ffffff", "#f6d9a8", "#e08a1e", "#a3301f"])


def shown_keys(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Candidates worth showing: the best ranked, and all that were named or tried."""
    ranked = sorted(diagnosis.ranking, key=lambda r: -r.gain)
    best = [r.key for r in ranked if r.visible]
    must = {*named_keys(diagnosis), *(t.key for r in diagnosis.rounds for t in r.trials)}
    kept = [key for index, key in enumerate(best) if index < MOST_CANDIDATES or key in must]
    return (*kept, *sorted(must - set(kept)))


def named_keys(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Keys of the causes of the verdict."""
    return tuple(f"{c.effect}@{c.site}" if c.site else c.effect for c in diagnosis.verdict.causes)


def ranking_svg(diagnosis: Diagnosis) -> str:
    """Share of the error that each candidate explains; dots: held out, after a full fit."""
    keys = shown_keys(diagnosis)
    gains = {r.key: r.gain for r in diagnosis.ranking}
    first = diagnosis.rounds[0] if diagnosis.rounds else None
    fitted = {t.key: t.held_out for t in first.trials} if first else {}
    named = named_keys(diagnosis)
    with matplotlib.rc_context(FIGURE_STYLE):
        figure = Figure(figsize=(10.2, 0.27 * len(keys) + 0.9))
        axis = figure.subplots()
        y = np.arange(len(keys))
        colours = [_NAMED if key in named else _OTHER for key in keys]
        axis.barh(y, [100 * gains.get(key, 0.0) for key in keys], height=0.62, color=colours)
        dots = [(100 * fitted[key], row) for row, key in enumerate(keys) if key in fitted]
        if dots:
            x, rows = zip(*dots, strict=True)
            axis.plot(x, rows, "o", color=css(palette.INK), markersize=5, label="fitted, held out")
        if first is not None:
            axis.axvline(
                100 * first.threshold,
                color=css(palette.WARNING_STATES[3]),
                linewidth=1.0,
                linestyle=(0, (4, 3)),
                label="what chance reaches in 5 % of cases",
            )
        axis.set_yticks(y, [key_words(key) for key in keys])
        axis.invert_yaxis()
        axis.grid(visible=False, axis="y")
        axis.set_xlim(min(0.0, *(x for x, _ in dots), 0.0) - 1, None)
        axis.set_xlabel("share of the error explained [%]")
        if dots or first is not None:
            axis.legend(loc="lower right")
        return svg_text(figure, "What each cause would explain")


def confounding_svg(confounding: Confounding, keys: tuple[str, ...]) -> str:
    """How alike the traces of candidates in these data are: 1 cannot be told apart."""
    known = [key for key in keys if key in confounding.keys]
    index = _alike_together(confounding, [confounding.keys.index(key) for key in known])
    likeness = np.abs(confounding.cosine[np.ix_(index, index)])
    names = [key_words(confounding.keys[i]) for i in index]
    with matplotlib.rc_context(FIGURE_STYLE):
        side = 0.34 * len(names) + 1.6
        figure = Figure(figsize=(side + 1.2, side))
        axis = figure.subplots()
        axis.imshow(np.nan_to_num(likeness), cmap=_LIKE, vmin=0.0, vmax=1.0)
        for row, column in np.argwhere((likeness >= 0.5) & ~np.eye(len(names), dtype=bool)):
            value = float(likeness[row, column])
            ink = "white" if value > 0.85 else css(palette.INK)
            told = f"{value:.2f}".removeprefix("0") if value < 0.995 else "1"
            axis.text(column, row, told, ha="center", va="center", fontsize=7, color=ink)
        axis.set_xticks(range(len(names)), names, rotation=60, ha="right", rotation_mode="anchor")
        axis.set_yticks(range(len(names)), names)
        axis.tick_params(length=0)
        axis.grid(visible=False)
        for spine in axis.spines.values():
            spine.set_visible(False)
        return svg_text(figure, "Which causes leave the same traces")


def _alike_together(confounding: Confounding, index: list[int]) -> list[int]:
    """The same candidates, each followed by what is most like it."""
    left, ordered = list(index), list[int]()
    while left:
        last = ordered[-1] if ordered else None
        likes = [0.0 if last is None else abs(confounding.cosine[last, i]) for i in left]
        ordered.append(left.pop(int(np.argmax(np.nan_to_num(likes)))))
    return ordered
