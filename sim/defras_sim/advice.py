"""Rules that an expert adds to a scene: what plans must not do, or should do where they can."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field, StringConstraints, model_validator

from defras_sim.scene_parts import GraspPoint, Part

Kind = Literal["forbid", "prefer"]

ACTIONS = ("reach", "open", "grasp", "pull", "move", "fold")
"""What rules can be about. Releasing is always allowed."""

ARMS = ("psm1", "psm2")
FORM = "an action, an arm, a point, or several of these in this order: grasp psm1 point (2,3)"

_MATTER = re.compile(
    rf"(?:(?P<action>{'|'.join(ACTIONS)})\b)?\s*(?:(?P<arm>{'|'.join(ARMS)})\b)?\s*"
    r"(?:point\s*\(\s*(?P<column>\d+)\s*,\s*(?P<row>\d+)\s*\))?"
)


@dataclass(frozen=True)
class Matter:
    """Which actions are meant; None means any."""

    action: str | None
    arm: str | None
    point: GraspPoint | None

    def covers(self, action: str, arm: str, point: GraspPoint) -> bool:
        return all(
            mine is None or mine == other
            for mine, other in ((self.action, action), (self.arm, arm), (self.point, point))
        )


def matter_of(text: str) -> Matter:
    """What a rule's text speaks of, like ``grasp psm1 point (2,3)``, ``fold`` or ``psm2``.

    Raises:
        ValueError: it cannot be read.
    """
    found = _MATTER.fullmatch(text.strip().lower())
    if found is None or not text.strip():
        raise ValueError(
            f"{text!r} is no rule; valid is {FORM}; actions: {', '.join(ACTIONS)}; arms: "
            f"{', '.join(ARMS)}"
        )
    point = (int(found["column"]), int(found["row"])) if found["column"] else None
    return Matter(found["action"], found["arm"], point)


class Advice(Part):
    """One rule: ``forbid`` or ``prefer`` with what it is about, its name, and the reason.

    A preferred action decides between plans of the same length.
    """

    name: Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_-]*$")]
    reason: Annotated[str, Field(min_length=1)]
    forbid: str | None = None
    prefer: str | None = None

    @model_validator(mode="after")
    def _says_one_thing(self) -> Advice:
        if (self.forbid is None) == (self.prefer is None):
            raise ValueError(f"rule {self.name!r} needs forbid or prefer, one of them")
        matter_of(self.text)
        return self

    @property
    def kind(self) -> Kind:
        return "prefer" if self.forbid is None else "forbid"

    @property
    def text(self) -> str:
        return self.forbid or self.prefer or ""

    @property
    def matter(self) -> Matter:
        return matter_of(self.text)

    def sentence(self) -> str:
        """Like: the rule "vein" forbids: grasp psm1 point (2,3) (a vein runs there)."""
        return f'the rule "{self.name}" {self.kind}s: {self.text} ({self.reason})'
