"""The causes that a diagnosis knows, as documentation.

``python -m defras_bt.diagnosis.effect_table docs/diagnosis.md`` puts both tables into a document.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

from defras_sim.effects.effect import Effect, EffectParameter
from defras_sim.effects.library import effects as library

_LAYERS = ("arm", "grasp", "tissue", "camera", "clock", "coupon")


def effect_table(effects: Iterable[Effect]) -> str:
    """``effects`` as a Markdown table, in the order in which their layers act."""
    rows = ["| effect | layer | twins | what it is | parameters |", "|---|---|---|---|---|"]
    for effect in _ordered(effects):
        parameters = "; ".join(_grouped(effect.parameters))
        twins = ", ".join(effect.twins)
        rows.append(
            f"| `{effect.name}` | {effect.layer} | {twins} | {effect.sentence} | {parameters} |"
        )
    return "\n".join(rows) + "\n"


def excitation_table(effects: Iterable[Effect]) -> str:
    """For each effect the motion that shows it, what speaks against it, and where it is from."""
    rows = ["| effect | shown best by | spoken against by | source |", "|---|---|---|---|"]
    rows += [
        f"| `{e.name}` | {e.excited_by} | {e.falsified_by} | {e.source} |"
        for e in _ordered(effects)
    ]
    return "\n".join(rows) + "\n"


def renewed(document: str, effects: Iterable[Effect]) -> str:
    """``document`` with its two tables of effects as they are now.

    Raises:
        ValueError: it has no such table.
    """
    listed = list(effects)
    for table in (effect_table(listed), excitation_table(listed)):
        head = table.splitlines(keepends=True)[0]
        before, found, rest = document.partition(head)
        if not found:
            raise ValueError(f"the document has no table that begins with {head.rstrip()!r}")
        after = rest.partition("\n\n")
        document = before + table + ("\n" + after[2] if after[1] else "")
    return document


def _ordered(effects: Iterable[Effect]) -> list[Effect]:
    return sorted(effects, key=lambda e: (_LAYERS.index(e.layer), e.name))


def _grouped(parameters: Iterable[EffectParameter]) -> list[str]:
    """Parameters of one meaning and unit together: ``x_m``, ``y_m`` [m]."""
    units: dict[str, list[str]] = {}
    for parameter in parameters:
        units.setdefault(parameter.unit, []).append(f"`{parameter.name}`")
    return [f"{', '.join(names)} [{unit or '1'}]" for unit, names in units.items()]


if __name__ == "__main__":
    file = Path(sys.argv[1])
    file.write_text(renewed(file.read_text(encoding="utf-8"), library()), encoding="utf-8")
