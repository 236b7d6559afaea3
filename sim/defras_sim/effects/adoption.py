"""What is wrong with the effects that a scene adopts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from typing import TYPE_CHECKING

from defras_sim.effects import library
from defras_sim.effects.effect import Effect
from defras_sim.yaml_source import Location

if TYPE_CHECKING:
    from defras_sim.scene import Scene


def adoption_faults(scene: Scene) -> Iterator[tuple[Location, str]]:
    """Where in its file ``scene`` adopts an effect that it cannot, and what would be valid."""
    known = {effect.name: effect for effect in library.effects()}
    usable = sorted(name for name, effect in known.items() if "tissue" in effect.twins)
    seen: set[str] = set()
    for i, adopted in enumerate(scene.model.effects):
        where: Location = ("model", "effects", i)
        path, name = f"model.effects.{i}", adopted.effect
        if name not in known:
            yield (
                (*where, "effect"),
                f"{path}.effect: there is no effect {name!r}; {_hint(name, usable)}",
            )
        elif name not in usable:
            twins = " or ".join(known[name].twins)
            yield (
                (*where, "effect"),
                f"{path}.effect: {name} is one of the {twins} twin, a scene's tissue cannot have "
                f"it; valid: {', '.join(usable)}",
            )
        elif name in seen:
            message = f"{path}.effect: {name} is adopted twice; give all its parameters once"
            yield (*where, "effect"), message
        else:
            faults = list(_value_faults(where, path, known[name], adopted.values))
            yield from faults or _tissue_faults(where, path, known[name], adopted.values, scene)
        seen.add(name)


def _value_faults(
    where: Location, path: str, effect: Effect, values: Mapping[str, float]
) -> Iterator[tuple[Location, str]]:
    bounds = {parameter.name: parameter for parameter in effect.parameters}
    for name, value in values.items():
        if name not in bounds:
            message = f"{effect.name} has no parameter {name!r}; {_hint(name, list(bounds))}"
            yield (*where, name), f"{path}.{name}: {message}"
            continue
        p = bounds[name]
        if not p.lower <= value <= p.upper:
            unit = "" if p.unit == "1" else f" {p.unit}"
            yield (
                (*where, name),
                f"{path}.{name}: {value:g} is out of bounds; {p.meaning} should be between "
                f"{p.lower:g} and {p.upper:g}{unit}",
            )


def _tissue_faults(
    where: Location, path: str, effect: Effect, values: Mapping[str, float], scene: Scene
) -> Iterator[tuple[Location, str]]:
    """Whether this tissue can have the effect, where the values alone are well."""
    # Effects on tissue know scenes, which are being checked here.
    from defras_sim.effects.tissue_effect import TissueEffect

    if isinstance(effect, TissueEffect):
        try:
            effect.scene(effect.complete(values), scene)
        except ValueError as fault:
            yield where, f"{path}: {fault}"


def _hint(name: str, valid: list[str]) -> str:
    near = get_close_matches(name, valid, n=1)
    return (f"did you mean {near[0]}? " if near else "") + f"valid: {', '.join(valid)}"
