"""Twins that take long, know derivatives, or know that they are off by themselves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from defras_bt.diagnosis.engine import diagnose
from defras_bt.diagnosis.problem import Candidate, Problem, Samples, Tangent
from defras_bt.diagnosis.settings import Settings
from defras_bt.diagnosis.verdict import Verdict
from defras_sim.effects.effect import Extension, Values
from defras_sim.geometry import Floats
from tests.diagnosis.toy_problem import ToyProblem, toy

HIDDEN = {"offset": {"q2_offset": 3.0}, "scale": {"q1_scale": 0.6}}


@dataclass
class _Wrapped:
    toy: ToyProblem

    @property
    def samples(self) -> Samples:
        return self.toy.samples

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        return self.toy.candidates

    def residual(self, model: Extension) -> Floats:
        return self.toy.residual(model)

    def tangents(self, model: Extension, candidate: Candidate) -> Sequence[Tangent]:
        return self.toy.tangents(model, candidate)


@dataclass
class Slow(_Wrapped):
    """Several models at once, and derivatives by the way."""

    foreseen: list[str] = field(default_factory=list)
    differentiated: int = 0

    def foresee(self, models: Sequence[Extension]) -> None:
        self.foreseen += map(repr, models)

    def derivatives(
        self, model: Extension, candidates: Sequence[Candidate]
    ) -> Mapping[tuple[str, str], Floats]:
        self.differentiated += 1
        found = {}
        for candidate in candidates:
            (tangent, *_) = self.tangents(model, candidate)
            ((name, step),) = tangent.steps[0].items()
            found[candidate.key, name] = tangent.columns[:, 0] / step
        return found


@dataclass
class Rough(_Wrapped):
    """Off by an unknown constant in each joint."""

    off: float = 1.0

    def approximations(self, count: int, rng: np.random.Generator) -> Floats:
        constants = self.off * rng.standard_normal((len(self.samples.channels), count))
        return np.asarray(constants[self.samples.channel])

    def systematic(
        self,
        residual: Floats,
        candidate: Candidate,
        columns: Mapping[str, Floats],
        rng: np.random.Generator,
    ) -> Values:
        return {p.name: self.off for p in candidate.free}


def test_known_derivatives_lead_to_the_same_verdict_with_fewer_predictions() -> None:
    measured = toy(np.random.default_rng(3), HIDDEN)
    plain = diagnose(_Wrapped(measured), np.random.default_rng(5))
    slow = Slow(measured)
    quick = diagnose(slow, np.random.default_rng(5))
    assert slow.differentiated > 0
    assert quick.residual_calls < plain.residual_calls
    for one, other in zip(plain.verdict.causes, quick.verdict.causes, strict=True):
        assert (one.effect, one.site) == (other.effect, other.site)
        for name, estimate in one.parameters.items():
            low, high = estimate.interval90
            assert abs(other.parameters[name].value - estimate.value) < 0.2 * (high - low)


def test_a_slow_twin_predicts_no_oftener_than_it_may_and_says_so() -> None:
    slow = Slow(toy(np.random.default_rng(3), HIDDEN))
    found = diagnose(slow, np.random.default_rng(5), settings=Settings(predictions=1))
    assert found.complete
    assert any("ended after 1 predictions" in warning for warning in found.verdict.warnings)
    whole = diagnose(slow, np.random.default_rng(5))
    assert not any("predictions" in warning for warning in whole.verdict.warnings)
    assert found.residual_calls < whole.residual_calls


def test_what_the_twin_may_be_off_by_is_not_blamed_on_a_cause() -> None:
    hidden = {"offset": {"q2_offset": 1.0}}
    measured = toy(np.random.default_rng(3), hidden, sd=0.2)
    sure = diagnose(Rough(measured, off=0.0), np.random.default_rng(5))
    assert [cause.effect for cause in sure.verdict.causes] == ["offset"]
    rough = diagnose(Rough(measured, off=2.0), np.random.default_rng(5))
    assert not rough.verdict.causes


def test_intervals_hold_what_the_twin_is_off_by() -> None:
    measured = toy(np.random.default_rng(3), {"offset": {"q2_offset": 9.0}}, sd=0.2)
    widths = {}
    for off in (0.0, 0.5):
        found = diagnose(Rough(measured, off=off), np.random.default_rng(5))
        (cause,) = found.verdict.causes
        low, high = cause.parameters["q2_offset"].interval90
        widths[off] = (high - low) / 2
    assert widths[0.5] > 1.645 * 0.5
    assert widths[0.0] < 0.5 * widths[0.5]


@dataclass
class Coarse(_Wrapped):
    """Off as if another cause were there too, until it is made accurate where the model stands."""

    approaches: bool = True
    stood: list[Extension] = field(default_factory=list)

    def residual(self, model: Extension) -> Floats:
        like = {"scale": {"q1_scale": 0.5}}
        off = self.toy.residual({}) - self.toy.residual(like)
        near = any(each and set(each) <= set(model) for each in self.stood)
        return np.asarray(self.toy.residual(model) + (0.0 if near else off))

    def approach(self, model: Extension) -> bool:
        anew = self.approaches and model not in self.stood
        if self.approaches:
            self.stood.append(model)
        return anew


def test_what_a_coarse_twin_gets_wrong_is_not_named_once_it_is_accurate() -> None:
    measured = toy(np.random.default_rng(3), {"offset": {"q2_offset": 3.0}})
    stays = diagnose(Coarse(measured, approaches=False), np.random.default_rng(5))
    assert sorted(cause.effect for cause in stays.verdict.causes) == ["offset", "scale"]
    coarse = Coarse(measured)
    found = diagnose(coarse, np.random.default_rng(5))
    assert [cause.effect for cause in found.verdict.causes] == ["offset"]
    value = found.verdict.causes[0].parameters["q2_offset"]
    assert value.interval90[0] <= 3.0 <= value.interval90[1]
    assert set(coarse.stood[-1]) == {"offset"}, "what is asked last is asked of what was named"


def test_a_twin_that_knows_how_far_it_is_off_names_only_what_leaves_little_more() -> None:
    hidden = {"scale": {"q1_scale": 0.8}, "bend": {"q1_bend": 0.035}}
    measured = toy(np.random.default_rng(3), hidden, leave_out=("bend", "coupling", "play"))

    def asked(problem: Problem, may_stay: float | None = None) -> Verdict:
        settings = Settings(outside_share=may_stay)
        return diagnose(problem, np.random.default_rng(0), settings=settings).verdict

    unaware = asked(measured)
    assert unaware.verdict == "named"
    assert 0.05 < (unaware.unexplained_share or 0.0) < 0.25
    aware = asked(Rough(measured, off=0.001))
    assert aware.verdict == "outside"
    assert not aware.causes
    assert any("--may-stay" in sentence for sentence in aware.warnings)
    assert asked(Rough(measured, off=0.001), may_stay=0.25).verdict == "named"
    farther_off = asked(Rough(measured, off=0.5))
    assert farther_off.verdict == "named"
    assert not any("is not without order" in sentence for sentence in farther_off.warnings)
    assert asked(Rough(measured, off=2.0)).verdict == "nothing"
