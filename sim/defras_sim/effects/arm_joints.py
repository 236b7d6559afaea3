"""The six joints of an arm, as effects name and bound them."""

from __future__ import annotations

from typing import Literal

JointName = Literal["q1", "q2", "q3", "q4", "q5", "q6"]

JOINTS: tuple[JointName, ...] = ("q1", "q2", "q3", "q4", "q5", "q6")
"""Yaw, pitch, insertion, roll, wrist pitch, wrist yaw."""

WRIST: tuple[JointName, ...] = ("q4", "q5", "q6")
"""Driven by cables that run through the shaft together."""

_INSERTION = "q3"


def unit(joint: JointName) -> Literal["rad", "m"]:
    """m of the insertion, rad of all others."""
    return "m" if joint == _INSERTION else "rad"


def by_unit(joint: JointName, of_angle: float, of_length: float) -> float:
    """The one of two numbers that suits the joint."""
    return of_length if joint == _INSERTION else of_angle
