"""What a twin can show of its data beside the residuals: curves that people know, replays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from defras_sim.geometry import Floats
from defras_sim.surface import Surface


@dataclass(frozen=True)
class Comparison:
    """A curve that people know how to read, as force over stretch: measured and predicted (n,).

    Values are SI, in the units given; ``extended`` is what the model with all that was accepted
    predicts. NaN makes a gap.
    """

    name: str
    x_name: str
    x_unit: str
    y_name: str
    y_unit: str
    x: Floats
    measured: Floats
    plain: Floats
    extended: Floats


@dataclass(frozen=True)
class ReplayFrame:
    """One moment of a recorded retraction beside both models.

    ``cloud_m`` (n, 3) as the camera reported it; ``before_m``, ``after_m`` (n,): signed distance of
    each point (as each model has it that the camera sees) to the plain and the extended surface,
    NaN where a point is compared with nothing. ``tips_m`` by arm, each (3,); ``held`` are the arms
    that hold tissue.
    """

    time_s: float
    trajectory: str
    phase: str
    cloud_m: Floats
    before_m: Floats
    after_m: Floats
    plain: Surface
    extended: Surface
    tips_m: Mapping[str, Floats]
    held: tuple[str, ...] = ()


@dataclass(frozen=True)
class Exhibits:
    """``replay`` in order of trajectory and time."""

    comparisons: tuple[Comparison, ...] = ()
    replay: tuple[ReplayFrame, ...] = ()
