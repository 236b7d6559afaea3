"""Effects on the tissue: what it is made of, what holds it, what pulls at it.

An effect changes the scene that a model is built from (a modulus, a thickness), or it goes along
with the model, solve by solve, and changes terms of its energy, how firmly its holes hold, or where
they are, as time goes and as the tissue has been through something.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from defras_sim.effects.effect import Effect, Layer, TwinName, Values
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.tissue.assembly import ElasticBody
from defras_sim.tissue.material_points import MaterialTerm
from defras_sim.tissue.model import TissueModel
from defras_sim.tissue.parameters import Parameter
from defras_sim.tissue.softened import Part
from defras_sim.tissue.state import TissueState
from defras_sim.tissue.terms import Term


class NoSuchTissue(ValueError):
    """Values within their bounds that no tissue can have, as a load that would crush it."""


Memory = Any
"""What an evolution knows of the past; never changed once it was handed out."""

Terms = Mapping[str, Term]
"""What the energy is the sum of, by name."""


@dataclass(frozen=True)
class Direction:
    """How an effect's ``parameter`` shows at the present equilibrium.

    A change of it by one is one of ``by`` in each of the tissue's own parameters, for
    :meth:`defras_sim.tissue.model.TissueModel.sensitivities`. ``at`` are the effect's other
    parameters that belong to it: an effect that is absent may name several places or angles at
    which it could begin.
    """

    parameter: str
    at: Values
    by: Mapping[Parameter, float]


class Evolution:
    """One effect on one tissue model, from solve to solve; this one changes nothing.

    World time never runs backwards, except after :attr:`memory` was set to what it was then.
    """

    memory: Memory = None

    def before(self, time_s: float) -> bool:
        """Be ready for a solve at ``time_s``; whether one is due though no tip moved.

        Without :meth:`after` in between, later calls take the place of earlier ones.
        """
        return False

    def terms(self, terms: Terms) -> Terms:
        """The model's terms as this effect makes them, of those that effects of lower rank left.

        Attachments and grasps are not among them. Terms that stay should be the same objects.
        """
        return terms

    def hold_n_per_m(self, stiffness_n_per_m: Floats) -> Floats:
        """How firmly each hole (holes,) holds that would hold with ``stiffness_n_per_m``."""
        return stiffness_n_per_m

    def lift_m(self) -> float:
        """How much higher than modelled the bed and what holds the tissue to it are by now."""
        return 0.0

    def dent_factor(self) -> float:
        """By how many times the dents at holes and jaws are stiffer by now than modelled: what is
        too small for the mesh, and so not among the terms."""
        return 1.0

    def after(self, time_s: float, state: TissueState) -> bool:
        """Learn from the equilibrium ``state`` at ``time_s``; whether it does not last: something
        tore, so that the solve is due again. Stale states are not learnt from."""
        return False

    def directions(self) -> tuple[Direction, ...]:
        """Derivatives at the last equilibrium, where implicit differentiation gives them.

        What an effect of history would be by now is known only if it was begun, at its null values,
        when the motion was.
        """
        return ()


def base_material(terms: Terms) -> ElasticBody:
    """The elastic body among ``terms``, for effects of a rank at which it is still one.

    Raises:
        TypeError: it is none any more.
    """
    body = terms["material"]
    if not isinstance(body, ElasticBody):
        raise TypeError(
            f"the material is a {type(body).__name__} already; effects that build on an elastic "
            "body should have a lower rank than those that wrap it"
        )
    return body


def material_parts(terms: Terms) -> tuple[Part, ...]:
    """The material and what was put beside it."""
    return tuple(t for t in terms.values() if isinstance(t, ElasticBody | MaterialTerm))


class TissueEffect(Effect):
    """Changes the tissue; at its null values not at all."""

    layer: ClassVar[Layer] = "tissue"
    twins: ClassVar[tuple[TwinName, ...]] = ("tissue",)
    rank: ClassVar[int] = 0
    """Effects of a lower rank act first: a material fades as it is after it has softened."""

    def scene(self, values: Values, scene: Scene) -> Scene:
        """What the model is built from.

        Raises:
            NoSuchTissue: no tissue can be like that.
        """
        return scene

    def begin(self, values: Values, model: TissueModel) -> Evolution:
        """Go along with ``model``, whose tissue rests and was not touched yet."""
        return Evolution()


class Steady(Evolution):
    """An effect that does not change with time, with its directions."""

    def __init__(self, known: tuple[Direction, ...]) -> None:
        self._known = known

    def directions(self) -> tuple[Direction, ...]:
        return self._known
