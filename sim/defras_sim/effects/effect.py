"""Effect: a named physical cause by which reality differs from the plain model.

An effect belongs to one layer of a twin and changes that layer's function; at the null values of
its parameters the layer is exactly the plain one. Each effect is a subclass in a file of its own,
registered by entry point (:mod:`defras_sim.effects.library`); it overrides the hooks of its layer
and leaves the others.
"""

from __future__ import annotations

from abc import ABC
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

from defras_sim.geometry import Floats

Layer = Literal["arm", "grasp", "tissue", "camera", "clock", "coupon"]
TwinName = Literal["tissue", "arm", "coupon"]

Values = Mapping[str, float]
"""Parameters of one effect by name; those not named are at their null values."""

Extension = Mapping[str, Values]
"""Effects of a model by name; those not named are at their null values."""


@dataclass(frozen=True)
class EffectParameter:
    """One number of an effect.

    ``null``: where the effect is absent (any value may be meaningless then, as the place of an
    attachment of no stiffness: ``strength`` is False for such). ``amount``: of these, one in
    which predictions are linear where the effect is there; like a strength it is tuned anew where
    data are held out, while a place or a time stays. ``step``: a change that typically shows, by
    which derivatives and searches are scaled.
    """

    name: str
    unit: str
    null: float
    lower: float
    upper: float
    step: float
    meaning: str
    strength: bool = True
    amount: bool = False

    @property
    def is_tuned(self) -> bool:
        """Whether it is tuned anew where data are held out."""
        return self.strength or self.amount


class Effect(ABC):
    """What all effects say about themselves."""

    name: ClassVar[str]
    layer: ClassVar[Layer]
    twins: ClassVar[tuple[TwinName, ...]]
    """Twins in which it can show."""
    sentence: ClassVar[str]
    """One plain sentence of what is different from the plain model."""
    parameters: ClassVar[tuple[EffectParameter, ...]]
    falsified_by: ClassVar[str]
    """What in the data would speak against it."""
    excited_by: ClassVar[str]
    """The safe motion that shows it best."""
    source: ClassVar[str]
    special_cases: ClassVar[tuple[str, ...]] = ()
    """Names of effects that this one comes to at some values of its parameters. Where one of them
    explains as much as chance often gives, it is the simpler explanation."""

    def __repr__(self) -> str:
        return self.name

    def complete(self, values: Values) -> dict[str, float]:
        """All parameters, null where ``values`` does not name them.

        Raises:
            ValueError: a name is unknown, or a value is outside its bounds.
        """
        known = {p.name: p for p in self.parameters}
        for name, value in values.items():
            if name not in known:
                raise ValueError(
                    f"effect {self.name} has no parameter {name!r}; it has: {', '.join(known)}"
                )
            p = known[name]
            if not p.lower <= value <= p.upper:
                raise ValueError(
                    f"{self.name}: {name} should be between {p.lower:g} and {p.upper:g} "
                    f"{p.unit}, is {value:g}"
                )
        return {p.name: float(values.get(p.name, p.null)) for p in self.parameters}

    def is_null(self, values: Values) -> bool:
        """Whether nothing that makes the effect strong differs from its null value."""
        strengths = (p for p in self.parameters if p.strength)
        return all(values.get(p.name, p.null) == p.null for p in strengths)


class ArmEffect(Effect):
    """Changes where an arm really goes; acts on whole histories, so memory needs no state.

    The last row is the present; an effect is causal, so histories can grow row by row.
    """

    layer: ClassVar[Layer] = "arm"
    encoders_see: ClassVar[bool] = False
    """Whether what the arm measures of itself shows it, as it shows a lag but no slack cable."""
    place: ClassVar[int] = 0
    """Along the drive from the motor to the tip: effects of a smaller place act first."""

    def joints(self, values: Values, time_s: Floats, joints: Floats) -> Floats:
        """True joint positions (n, 6) [rad, rad, m, rad, rad, rad] for those commanded (n, 6).

        Joints in the order yaw, pitch, insertion, roll, wrist pitch, wrist yaw, named q1 to q6.
        """
        return joints

    def tip_error(
        self, values: Values, tip_m: Floats, force_n: Floats, rcm_m: Floats
    ) -> tuple[Floats, Floats]:
        """Translation [m] and small rotation vector [rad] of the true tip (tissue frame), each
        (n, 3), where the arm believes its tip at ``tip_m`` (n, 3) and the tissue pulls at it with
        ``force_n`` (n, 3). ``rcm_m`` (3,): the arm's remote centre of motion."""
        return 0.0 * tip_m, 0.0 * tip_m
