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

    ``plain`` and ``extended`` are simulated surfaces, ``plain_cloud_m`` and ``extended_cloud_m``
    (n, 3) what the camera saw as each model corrects it, ``before_m`` and ``after_m`` (n,) its
    signed distances to them, positive outside of the tissue. ``tips_m`` by arm, each (3,), as told;
    ``held`` are the arms that hold tissue.
    """

    time_s: float
    trajectory: str
    phase: str
    plain: Surface
    extended: Surface
    plain_cloud_m: Floats
    extended_cloud_m: Floats
    before_m: Floats
    after_m: Floats
    tips_m: Mapping[str, Floats]
    held: tuple[str, ...] = ()


@dataclass(frozen=True)
class Exhibits:
    """``replay`` in order of trajectory and time."""

    comparisons: tuple[Comparison, ...] = ()
    replay: tuple[ReplayFrame, ...] = ()
