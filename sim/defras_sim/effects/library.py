"""The effects that are installed: this package's and those that others add.

A package adds an effect with an entry point of the group ``defras.effects`` that names an instance
of a subclass of :class:`defras_sim.effects.effect.Effect`.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.metadata import entry_points

from defras_sim.effects.effect import Effect, TwinName

GROUP = "defras.effects"


@cache
def _installed() -> dict[str, Effect]:
    found: dict[str, Effect] = {}
    for entry in entry_points(group=GROUP):
        effect = entry.load()
        if not isinstance(effect, Effect):
            raise TypeError(
                f"entry point {entry.name!r} of {GROUP} should be an instance of Effect, "
                f"is a {type(effect).__name__} ({entry.value})"
            )
        if effect.name in found:
            raise ValueError(f"two effects are called {effect.name!r}; names must be unique")
        found[effect.name] = effect
    for effect in found.values():
        check_special_cases(effect, found)
    return dict(sorted(found.items()))


def check_special_cases(effect: Effect, known: Mapping[str, Effect]) -> None:
    """See that the special cases of ``effect`` are others of the ``known`` effects, by name.

    Raises:
        TypeError: they are no tuple of names.
        ValueError: one of them is unknown, or the effect itself.
    """
    names = effect.special_cases
    if not isinstance(names, tuple) or not all(isinstance(name, str) for name in names):
        raise TypeError(f"{effect.name}: special_cases should be a tuple of names, is {names!r}")
    for name in names:
        if name not in known or name == effect.name:
            others = ", ".join(sorted(set(known) - {effect.name}))
            raise ValueError(
                f"{effect.name}: special case {name!r} should be another effect; there are {others}"
            )


def effects(twin: TwinName | None = None) -> tuple[Effect, ...]:
    """All effects, or those that can show in ``twin``, by name."""
    return tuple(e for e in _installed().values() if twin is None or twin in e.twins)


def effect(name: str) -> Effect:
    """The effect called ``name``.

    Raises:
        ValueError: there is none.
    """
    found = _installed().get(name)
    if found is None:
        raise ValueError(f"there is no effect {name!r}; there are: {', '.join(_installed())}")
    return found
