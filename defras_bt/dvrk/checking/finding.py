"""What a check found."""

from __future__ import annotations

from typing import Literal

from defras_sim.scene_parts import Part

Grade = Literal["ok", "warning", "wrong", "skipped"]


class Finding(Part):
    """One sentence about one matter. ``todo``: what mends it, "" where nothing has to be.

    ``wrong`` forbids a run; ``warning`` is for people to judge; ``skipped`` could not be looked at,
    and says why.
    """

    check: str
    about: str
    grade: Grade
    what: str
    todo: str = ""


def ok(check: str, about: str, what: str) -> Finding:
    return Finding(check=check, about=about, grade="ok", what=what)


def wrong(check: str, about: str, what: str, todo: str) -> Finding:
    return Finding(check=check, about=about, grade="wrong", what=what, todo=todo)


def warning(check: str, about: str, what: str, todo: str) -> Finding:
    return Finding(check=check, about=about, grade="warning", what=what, todo=todo)


def skipped(check: str, about: str, what: str, todo: str = "") -> Finding:
    return Finding(check=check, about=about, grade="skipped", what=what, todo=todo)
