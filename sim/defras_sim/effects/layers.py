"""Effects of a model sorted by the layer whose function they change."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

from defras_sim.effects import library
from defras_sim.effects.camera_effect import CameraEffect
from defras_sim.effects.clock_effect import ClockEffect
from defras_sim.effects.effect import ArmEffect, Effect, Extension, Values
from defras_sim.effects.grasp_effect import GraspEffect

AnyEffect = TypeVar("AnyEffect", bound=Effect)


@dataclass(frozen=True)
class Layers:
    """The layers of a twin of tissue: motion -> arm -> grasp -> tissue -> camera -> clock.

    Each holds its effects with all their parameters, in the order of their names. An effect at its
    null values is in none: the layer is then exactly the plain one.
    """

    arm: tuple[tuple[ArmEffect, Values], ...] = ()
    grasp: tuple[tuple[GraspEffect, Values], ...] = ()
    tissue: Mapping[str, Values] = field(default_factory=dict)
    camera: tuple[tuple[CameraEffect, Values], ...] = ()
    clock: tuple[tuple[ClockEffect, Values], ...] = ()

    @staticmethod
    def of(extension: Extension) -> Layers:
        """Sort the effects of ``extension``.

        Raises:
            ValueError: an effect or a parameter is unknown, out of bounds, or belongs to a twin of
                something else than tissue.
        """
        adopted: list[tuple[Effect, Values]] = []
        for name, given in sorted(extension.items()):
            effect = library.effect(name)
            if "tissue" not in effect.twins:
                raise ValueError(f"{name} shows in a twin of {' or '.join(effect.twins)} only")
            values = effect.complete(given)
            if not effect.is_null(values):
                adopted.append((effect, values))
        return Layers(
            arm=_of(ArmEffect, adopted),
            grasp=_of(GraspEffect, adopted),
            tissue={effect.name: values for effect, values in adopted if effect.layer == "tissue"},
            camera=_of(CameraEffect, adopted),
            clock=_of(ClockEffect, adopted),
        )

    @property
    def delay_s(self) -> float:
        """How much older than their stamps the depth camera's clouds are."""
        return sum(effect.delay_s(values) for effect, values in self.clock)


def _of(
    kind: type[AnyEffect], adopted: Sequence[tuple[Effect, Values]]
) -> tuple[tuple[AnyEffect, Values], ...]:
    return tuple((effect, values) for effect, values in adopted if isinstance(effect, kind))
