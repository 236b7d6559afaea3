"""The effects that are installed: this package's and those that others add.

A package adds an effect with an entry point of the group ``defras.effects`` that names an instance
of a subclass of :class:`defras_sim.effects.effect.Effect`.
"""

from __future__ import annotations

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
    return dict(sorted(found.items()))


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
