"""``report.html`` of a diagnosis: a page that stands on its own, for a person."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined, select_autoescape
from markupsafe import Markup

from defras_bt.diagnosis.diagnosis import Diagnosis, Statistic
from defras_bt.diagnosis.exhibits import Exhibits
from defras_bt.diagnosis.pictures_curves import curves_svg
from defras_bt.diagnosis.pictures_field import field_picture, percentile_m, worst_frame
from defras_bt.diagnosis.pictures_ranking import confounding_svg, ranking_svg, shown_keys
from defras_bt.diagnosis.pictures_time import (
    MOST_ROWS,
    MOST_TRAJECTORIES,
    over_time_svg,
    rows,
)
from defras_bt.diagnosis.pictures_tissue import has_places, tissue_maps_svg
from defras_bt.diagnosis.problem import Samples
from defras_bt.diagnosis.report_words import (
    TITLES,
    excluded_words,
    joined,
    key_words,
    quantity,
    readable,
    share_words,
    spoken,
    unit_shown,
    verdict_sentence,
)
from defras_bt.diagnosis.verdict import Estimate, Verdict
from defras_bt.diagnosis.verdict_file import Origin
from defras_bt.recording.report_parts import Panel, Tile
from defras_bt.recording.report_plots import png_uri
from defras_sim.effects.effect import Effect
from defras_sim.scene import Scene

_LEAST_SHOWN_ALIKE = 2


@dataclass(frozen=True)
class ParameterRow:
    """A parameter of a named cause as people read it; the bar spans the bounds of the effect."""

    name: str
    value: str
    interval: str
    meaning: str


def report_html(
    diagnosis: Diagnosis,
    origin: Origin,
    effects: Mapping[str, Effect],
    *,
    scene: Scene | None = None,
    exhibits: Exhibits | None = None,
) -> str:
    """The page. ``effects`` by name; ``scene`` is needed to draw on a tissue."""
    shown = exhibits or Exhibits()
    verdict, extended = diagnosis.verdict, diagnosis.model != diagnosis.base
    environment = Environment(
        loader=ChoiceLoader(
            [PackageLoader("defras_bt.diagnosis"), PackageLoader("defras_bt.recording")]
        ),
        autoescape=select_autoescape(),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    keys = shown_keys(diagnosis)
    alike = [key for key in keys if key in diagnosis.confounding.keys]
    compared = bool(np.isfinite(diagnosis.held_out_before).any())
    return environment.get_template("diagnosis.html").render(
        title=TITLES[verdict.verdict],
        sentence=verdict_sentence(verdict, effects),
        verdict=verdict,
        warnings=[readable(warning, effects) for warning in verdict.warnings],
        partial=[key_words(key) for key in diagnosis.partial],
        origin=origin,
        complete=diagnosis.complete,
        extended=extended,
        tiles=_tiles(verdict),
        causes=[
            {
                "name": key_words(cause.effect),
                "site": cause.site,
                "effect": effects.get(cause.effect),
                "gain": share_words(cause.gain),
                "alternatives": [key_words(key) for key in cause.cannot_tell],
                "rows": _parameters(cause.parameters, effects.get(cause.effect)),
            }
            for cause in verdict.causes
        ],
        ambiguous=[key_words(key) for key in verdict.ambiguous],
        alternatives=joined([key_words(key) for key in verdict.ambiguous]),
        measured=_measured(diagnosis.samples, diagnosis),
        faults=_faults(verdict),
        excess=_excess(diagnosis),
        maps=(
            Markup(tissue_maps_svg(diagnosis, scene, extended=extended))
            if scene is not None and compared and has_places(diagnosis)
            else None
        ),
        panels=_panels(shown, scene, extended=extended) if scene is not None else [],
        curves=(
            Markup(curves_svg(shown.comparisons, extended=extended)) if shown.comparisons else None
        ),
        over_time=Markup(over_time_svg(diagnosis, extended=extended)) if compared else None,
        more_sensors=max(0, len(rows(diagnosis.samples)) - MOST_ROWS),
        more_recordings=max(0, len(diagnosis.samples.trajectories) - MOST_TRAJECTORIES),
        portrait=_portrait(diagnosis.portrait),
        portrait_after=_portrait(diagnosis.portrait_after) if extended else [],
        ranking=Markup(ranking_svg(diagnosis)) if keys else None,
        confounding=(
            Markup(confounding_svg(diagnosis.confounding, tuple(alike)))
            if len(alike) >= _LEAST_SHOWN_ALIKE
            else None
        ),
        unseen=[key_words(key) for key in diagnosis.unseen],
        excluded=sorted(
            excluded_words(key, each)
            for key, each in verdict.excluded.items()
            if math.isfinite(each.strength)
        ),
    )


def _tiles(verdict: Verdict) -> list[Tile]:
    gain, left = verdict.gain, verdict.unexplained_share
    return [
        _gain_tile("Error removed", gain.in_range, "held out, same range"),
        _gain_tile("Beyond the range", gain.beyond_range, "motions that go further"),
        _gain_tile("New grasp point", gain.new_grasp, "another place of the tissue"),
        Tile(
            "Left unexplained",
            "none" if left is None else share_words(left),
            "of the error above the sensors' noise",
            "plain" if left is None or left < 0.3 else "bad",
        ),
    ]


def _gain_tile(name: str, gain: float | None, note: str) -> Tile:
    if gain is None:
        return Tile(name, "–", "these data cannot say")
    return Tile(name, share_words(gain), note, "good" if gain > 0 else "bad")


def _parameters(parameters: Mapping[str, Estimate], effect: Effect | None) -> list[ParameterRow]:
    meanings = {p.name: p.meaning for p in effect.parameters} if effect is not None else {}
    rows = []
    for name, estimate in parameters.items():
        low, high = (quantity(limit, estimate.unit) for limit in estimate.interval90)
        rows.append(
            ParameterRow(
                spoken(name),
                quantity(estimate.value, estimate.unit),
                f"{low} to {high}",
                meanings.get(name, ""),
            )
        )
    return rows


def _measured(samples: Samples, diagnosis: Diagnosis) -> list[dict[str, str]]:
    """What was compared, sensor by sensor."""
    rows = []
    for sensor in dict.fromkeys(channel.sensor for channel in samples.channels):
        members = [i for i, c in enumerate(samples.channels) if c.sensor == sensor]
        chosen = np.isin(samples.channel, members)
        used = chosen & np.isfinite(diagnosis.residual_before)
        unit = samples.channels[members[0]].unit
        noise = float(np.sqrt(np.mean([samples.channels[i].noise_sd ** 2 for i in members])))
        rows.append(
            {
                "sensor": sensor,
                "channels": f"{len(members)}",
                "compared": f"{int(used.sum()):,}".replace(",", " "),
                "left_out": f"{int((chosen & ~used).sum()):,}".replace(",", " "),
                "noise": quantity(noise, unit),
            }
        )
    return rows


def _faults(verdict: Verdict) -> list[str]:
    """Sentences on what was wrong with the data."""
    faults = verdict.data_quality.get("faults", ())
    if not isinstance(faults, (list, tuple)):
        raise TypeError(f"data_quality.faults should be a list, is a {type(faults).__name__}")
    return [str(f["sentence"]) if isinstance(f, Mapping) else str(f) for f in faults]


def _excess(diagnosis: Diagnosis) -> list[dict[str, str]]:
    """Errors by sensor in its own unit, held out."""
    rows = []
    for each in diagnosis.excess:
        factor, unit = unit_shown(each.unit)
        rows.append(
            {
                "sensor": each.sensor,
                "unit": unit,
                "plain": f"{factor * each.plain_rms:.3g}",
                "extended": f"{factor * each.extended_rms:.3g}",
                "noise": f"{factor * each.noise_rms:.3g}",
            }
        )
    return rows


def _portrait(statistics: tuple[Statistic, ...]) -> list[str]:
    """Sentences of what stands out."""
    return list(dict.fromkeys(s.sentence for s in statistics if s.stands_out))


def _panels(exhibits: Exhibits, scene: Scene, *, extended: bool) -> list[Panel]:
    frame = worst_frame(exhibits.replay)
    if frame is None:
        return []
    when = f"{frame.time_s:.1f} s ({frame.phase})"
    before = quantity(round(percentile_m(frame.before_m), 5), "m")
    panels = [
        Panel(
            f"Simulation as it was at {when}: 95 % of what was seen lies within {before} of it",
            png_uri(field_picture(frame, scene, extended=False)),
        )
    ]
    if extended:
        after = quantity(round(percentile_m(frame.after_m), 5), "m")
        panels.append(
            Panel(
                f"Extended simulation at the same moment: within {after}",
                png_uri(field_picture(frame, scene, extended=True)),
            )
        )
    return panels
