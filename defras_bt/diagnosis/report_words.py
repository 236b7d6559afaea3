"""A verdict in sentences that a surgeon understands."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence

from defras_bt.diagnosis.verdict import Cause, Estimate, Excluded, Verdict
from defras_sim.effects.effect import Effect

TITLES = {
    "named": "The cause is named",
    "set": "The cause is one of a few",
    "outside": "No known cause explains it",
    "nothing": "The simulation agrees",
}
_SCALED: dict[str, tuple[float, str]] = {
    "m": (1e3, "mm"),
    "rad": (math.degrees(1.0), "°"),
    "m/N": (1e3, "mm/N"),
    "rad/N": (math.degrees(1.0), "°/N"),
    "m/s^2": (1.0, "m/s²"),
}
_PURE = ("", "1", "rad/rad", "m/m")
_DIGITS = 3
_KEY = re.compile(r"\b([a-z]+(?:_[a-z]+)*)(?:@[a-z0-9]+(?:(?:<-|,)[a-z0-9]+)*)?")


def key_words(key: str) -> str:
    """``joint_play@q5`` as ``joint play (q5)``."""
    effect, _, site = key.partition("@")
    name = effect.replace("_", " ")
    return f"{name} ({site})" if site else name


def readable(text: str, effects: Collection[str]) -> str:
    """``text`` with keys of ``effects`` in it as words."""

    def words(found: re.Match[str]) -> str:
        return key_words(found[0]) if found[1] in effects else found[0]

    return _KEY.sub(words, text)


def quantity(value: float, unit: str) -> str:
    """Like ``2.5 mm`` for 0.0025 m; infinity for a limit that the data do not set."""
    if not math.isfinite(value):
        return "unlimited"
    factor, shown = unit_shown(unit)
    return f"{value * factor:.{_DIGITS}g} {shown}".strip()


def unit_shown(unit: str) -> tuple[float, str]:
    """Factor and name of the unit in which people read values given in ``unit``."""
    return _SCALED.get(unit, (1.0, "" if unit in _PURE else unit))


def estimate_words(estimate: Estimate) -> str:
    """Like ``2.5 mm (90 %: 2.1 to 2.9 mm)``."""
    low, high = estimate.interval90
    value = quantity(estimate.value, estimate.unit)
    if not (math.isfinite(low) or math.isfinite(high)):
        return f"{value} (any value fits the data as well)"
    if not math.isfinite(high):
        return f"{value} (90 %: more than {quantity(low, estimate.unit)})"
    if not math.isfinite(low):
        return f"{value} (90 %: less than {quantity(high, estimate.unit)})"
    factor, shown = unit_shown(estimate.unit)
    span = f"{low * factor:.{_DIGITS}g} to {high * factor:.{_DIGITS}g} {shown}".strip()
    return f"{value} (90 %: {span})"


def cause_words(cause: Cause) -> str:
    """Like ``depth bias (q5): offset 2 mm (90 %: 1.8 to 2.2 mm), scale 1.01 (...)``."""
    name = key_words(f"{cause.effect}@{cause.site}" if cause.site else cause.effect)
    told = [f"{spoken(p)} {estimate_words(e)}" for p, e in cause.parameters.items()]
    return f"{name}: {', '.join(told)}" if told else name


def spoken(parameter: str) -> str:
    """A parameter's name without the unit that its value is given with."""
    for ending in ("_n_per_m", "_m_per_n", "_m_s2", "_rad", "_pa", "_n", "_m", "_s"):
        if parameter.endswith(ending) and len(parameter) > len(ending):
            return parameter.removesuffix(ending).replace("_", " ")
    return parameter.replace("_", " ")


def excluded_words(key: str, excluded: Excluded) -> str:
    """Like ``joint play (q5): more than 0.4 ° would have shown``."""
    strength = quantity(excluded.strength, excluded.unit)
    return f"{key_words(key)}: {spoken(excluded.parameter)} of more than {strength}"


def share_words(share: float | None) -> str:
    """Like ``83 %``; ``unknown`` where the data cannot say."""
    return "unknown" if share is None or not math.isfinite(share) else f"{100 * share:.0f} %"


def verdict_sentence(verdict: Verdict, effects: Mapping[str, Effect]) -> str:
    """The verdict in one or two sentences. ``effects`` by name; those unknown are only named."""
    left = share_words(verdict.unexplained_share)
    if verdict.verdict == "nothing":
        return "The simulation agrees with what was measured, as well as the sensors can tell."
    if verdict.verdict == "outside":
        known = _named(verdict, effects)
        partly = f" Part of it is known: {known}" if known else ""
        return (
            "The simulation differs from what was measured in a way that none of the known causes "
            f"explains; {left} of the error stays unexplained.{partly}"
        )
    if verdict.verdict == "set":
        return (
            "The simulation differs from what was measured, and these data cannot tell why: "
            f"{either([key_words(key) for key in verdict.ambiguous])}."
        )
    these = "These are" if len(verdict.causes) > 1 else "This is"
    return f"{these} missing from the simulation: {_named(verdict, effects)} {_gain_words(verdict)}"


def either(names: Sequence[str]) -> str:
    """Like ``a, b or c``."""
    return joined(names, "or")


def joined(names: Sequence[str], last: str = "and") -> str:
    """Like ``a, b and c``."""
    return f" {last} ".join(part for part in (", ".join(names[:-1]), *names[-1:]) if part)


def _named(verdict: Verdict, effects: Mapping[str, Effect]) -> str:
    """What each named effect means, with its values; the intervals stand elsewhere."""
    told = "; ".join(_cause_sentence(cause, effects) for cause in verdict.causes)
    return f"{told}." if told else ""


def _cause_sentence(cause: Cause, effects: Mapping[str, Effect]) -> str:
    name = key_words(f"{cause.effect}@{cause.site}" if cause.site else cause.effect)
    values = [f"{spoken(p)} {quantity(e.value, e.unit)}" for p, e in cause.parameters.items()]
    told = f"{name}: {', '.join(values)}" if values else name
    effect = effects.get(cause.effect)
    if effect is None:
        return told
    meaning = effect.sentence.rstrip(".")
    return f"{meaning[0].lower()}{meaning[1:]} ({told})"


def _gain_words(verdict: Verdict) -> str:
    gain = verdict.gain.in_range
    if gain is None:
        return "What this gains could not be measured."
    if gain <= 0:
        return "Yet the extended model is no better on data that it was not fitted to."
    return (
        f"With it the model loses {share_words(gain)} of its error above the sensors' noise, on "
        "data that it was not fitted to."
    )
