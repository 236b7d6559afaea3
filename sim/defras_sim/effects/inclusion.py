"""A part of the tissue is stiffer or softer than the rest."""

from __future__ import annotations

from defras_sim.effects.disc import PLACE, Disc
from defras_sim.effects.effect import EffectParameter, Values
from defras_sim.effects.tissue_effect import (
    Direction,
    Evolution,
    Terms,
    TissueEffect,
    base_material,
)
from defras_sim.geometry import Floats
from defras_sim.tissue.assembly import ElasticBody
from defras_sim.tissue.model import TissueModel
from defras_sim.tissue.parameters import Parameter, TermParameter

SCALE = "scale"
# Sharper rims are integrated to several percent only on elements of 15 mm.
RIM_M = 0.010


class Inclusion(TissueEffect):
    """Young's modulus is ``scale`` times the believed one in a disc, through the whole thickness.

    The dents that holes and jaws make there stay those of the tissue around.
    """

    name = "inclusion"
    sentence = "A part of the tissue is stiffer or softer than the rest."
    parameters = (
        EffectParameter(
            SCALE, "1", null=1.0, lower=0.02, upper=100.0, step=0.5,
            meaning="Young's modulus in the disc by that around it",
        ),
        *PLACE,
    )  # fmt: skip
    falsified_by = "The tissue bends and stretches as evenly across the disc as modelled."
    excited_by = "Folds and pulls across the disc from different sides."
    source = "Heterogeneous modulus field; Bonet and Wood, 2nd ed., ch. 6."

    def begin(self, values: Values, model: TissueModel) -> Evolution:
        return _Included(Disc.of(values, RIM_M), values[SCALE])


class _Included(Evolution):
    def __init__(self, disc: Disc, scale: float) -> None:
        self._disc, self._scale = disc, scale
        self._made_of: ElasticBody | None = None
        self._body: ElasticBody | None = None
        self._known: tuple[Direction, ...] = ()

    def terms(self, terms: Terms) -> Terms:
        body = base_material(terms)
        if self._made_of is not body:
            self._made_of = body
            self._body = self._stiffened(body)
        assert self._body is not None
        return {**terms, body.name: self._body}

    def directions(self) -> tuple[Direction, ...]:
        return self._known

    def _stiffened(self, body: ElasticBody) -> ElasticBody:
        """``body`` with the disc, and modes by which it may grow."""
        xy_m = body.points.now_m(body.mesh.nodes_m)[..., :2]
        more = self._scale - 1
        share = self._disc.share(xy_m)
        if more == 0.0:
            discs = tuple(self._disc.elsewhere(body.mesh.nodes_m[:, :2]))
            names = tuple(f"inclusion_{number}" for number in range(len(discs)))
            self._known = tuple(
                Direction(SCALE, disc.place, _by(name))
                for name, disc in zip(names, discs, strict=True)
            )
            modes = {n: d.share(xy_m) for n, d in zip(names, discs, strict=True)}
            return body.with_modes(modes)
        slopes: dict[str, Floats] = {SCALE: share}
        slopes |= {name: more * each for name, each in self._disc.share_by(xy_m).items()}
        self._known = tuple(Direction(name, {}, _by(f"inclusion_{name}")) for name in slopes)
        factor = 1 + more * share
        stiffened = body.with_lame(factor * body.mu_pa, factor * body.lam_pa)
        return stiffened.with_modes({f"inclusion_{n}": s / factor for n, s in slopes.items()})


def _by(mode: str) -> dict[Parameter, float]:
    return {TermParameter("material", mode): 1.0}


EFFECT = Inclusion()
