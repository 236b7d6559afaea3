"""The whole way on problems whose truth is known."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from defras_bt.diagnosis import engine, verdict_building
from defras_bt.diagnosis.diagnosis import Diagnosis
from defras_bt.diagnosis.engine import diagnose
from defras_bt.diagnosis.problem import Samples
from defras_bt.diagnosis.settings import Settings
from defras_sim.effects.effect import Extension
from defras_sim.geometry import Floats
from tests.diagnosis.toy_problem import ToyProblem, toy

Hidden = Mapping[str, Mapping[str, float]]


def _diagnosed(hidden: Hidden, seed: int = 3, **options: object) -> Diagnosis:
    rng = np.random.default_rng(seed)
    return diagnose(toy(rng, hidden, **options), rng)


def _named(found: Diagnosis) -> list[str]:
    return sorted(f"{c.effect}@{c.site}" for c in found.verdict.causes)


def test_nothing_is_named_where_nothing_is_and_strengths_are_excluded() -> None:
    found = _diagnosed({})
    assert found.verdict.verdict == "nothing"
    assert not found.verdict.causes
    play = found.verdict.excluded["play@q1"]
    assert play.parameter == "q1_play"
    assert 0.0 < play.strength < 1.0
    assert found.complete


@pytest.mark.parametrize(
    ("hidden", "key"),
    [
        ({"play": {"q1_play": 1.0}}, "play@q1"),
        ({"bend": {"q1_bend": 0.2}}, "bend@q1"),
        ({"scale": {"q2_scale": 0.6}}, "scale@q2"),
        ({"coupling": {"q3_from_q1": 0.5}}, "coupling@q3_from_q1"),
    ],
)
@pytest.mark.parametrize("gaps", [0.0, 0.15])
def test_one_cause_is_named_with_an_interval_that_covers_it(
    hidden: Hidden, key: str, gaps: float
) -> None:
    found = _diagnosed(hidden, gaps=gaps)
    assert _named(found) == [key]
    (cause,) = found.verdict.causes
    ((name, truth),) = next(iter(hidden.values())).items()
    low, high = cause.parameters[name].interval90
    width = high - low
    assert low - 0.5 * width < truth < high + 0.5 * width
    assert 0.0 < width < truth
    assert key not in found.verdict.excluded
    assert found.verdict.gain.in_range is None or found.verdict.gain.in_range > 0.2


def test_two_causes_in_several_trajectories() -> None:
    found = _diagnosed(
        {"offset": {"q2_offset": 3.0}, "play": {"q1_play": 2.0}}, length=400, trajectories=3
    )
    assert _named(found) == ["offset@q2", "play@q1"]
    assert found.verdict.gain.in_range is not None
    assert found.verdict.gain.in_range > 0.8
    assert len(found.fold_gain) == 24


def test_a_cause_out_of_the_library_is_outside_and_no_other_is_named() -> None:
    found = _diagnosed({"bend": {"q1_bend": 0.5}}, leave_out=("bend",))
    assert found.verdict.verdict == "outside"
    assert not found.verdict.causes
    assert "joints" in " ".join(found.verdict.warnings)


def test_what_changes_nothing_is_said_to_be_unseen() -> None:
    found = _diagnosed({"scale": {"q1_scale": 0.5}})
    assert found.unseen == ("ghost",)
    assert "ghost" not in found.verdict.excluded
    assert any("ghost changes nothing" in w for w in found.verdict.warnings)


def test_a_nuisance_is_named_only_where_nothing_else_explains_it() -> None:
    other = _diagnosed({"bend": {"q2_bend": 0.3}}, nuisance=("offset",))
    assert _named(other) == ["bend@q2"]
    own = _diagnosed({"offset": {"q2_offset": 4.0}}, nuisance=("offset",))
    assert _named(own) == ["offset@q2"]


def _scale_like_coupling(**options: Any) -> Diagnosis:
    """Both joints are told the same, so that a scale of q1 is a coupling from q2."""
    rng = np.random.default_rng(5)
    problem = toy(rng, {"scale": {"q1_scale": 0.6}}, channels=2)
    copied = [np.repeat(s[:, :1], 2, axis=1) for s in problem.setpoints]
    measured = [
        c + (m - s) for c, m, s in zip(copied, problem.measured, problem.setpoints, strict=True)
    ]
    return diagnose(ToyProblem(copied, measured, **options), rng)


def test_causes_that_cannot_be_told_apart_are_a_set() -> None:
    found = _scale_like_coupling()
    assert found.verdict.verdict == "set"
    assert set(found.verdict.ambiguous) == {"scale", "coupling"}
    assert found.confounding.alike("scale@q1")[0] == "coupling@q1_from_q2"


@pytest.mark.parametrize(
    ("general", "special", "key"),
    [("coupling", "scale", "scale@q1"), ("scale", "coupling", "coupling@q1_from_q2")],
)
def test_a_special_case_that_explains_as_much_is_named_instead(
    general: str, special: str, key: str
) -> None:
    found = _scale_like_coupling(special_cases={general: (special,)})
    assert found.verdict.verdict == "named"
    assert _named(found) == [key]
    (cause,) = found.verdict.causes
    ((low, high),) = [p.interval90 for p in cause.parameters.values()]
    assert 0.3 < low < high < 0.9


@pytest.mark.parametrize("seed", [0, 2, 3])
def test_a_cause_that_is_ahead_of_its_special_case_does_not_give_way(seed: int) -> None:
    """Hidden is the general cause. What both joints are told differs too little to reject the
    special one, but enough for such a lead to be rare with it."""
    p = toy(np.random.default_rng(seed), {}, channels=2, length=600, ar=(0.6,))
    told, noise = p.setpoints[0].copy(), p.measured[0] - p.setpoints[0]
    told[:, 1] = told[:, 0] + 0.1 * told[:, 1]
    measured = told + noise
    measured[:, 0] += 0.3 * told[:, 1]
    problem = ToyProblem(
        [told],
        [measured],
        leave_out=["offset", "play", "bend", "ghost"],
        special_cases={"coupling": ("scale",)},
    )
    found = diagnose(problem, np.random.default_rng(0))
    assert found.verdict.verdict == "set"
    assert found.verdict.ambiguous == ("coupling", "scale")


def test_what_stood_in_the_shadow_of_a_doubtful_cause_is_looked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two causes that do the same: when the one that was accepted may as well be absent, the other
    is found, and the first is not tried again."""
    first, other = "coupling@q1_from_q2", "scale@q1"
    if _named(_scale_like_coupling()) == [other]:
        first, other = other, first
    monkeypatch.setattr(engine, "_may_be_absent", lambda _, key: key == first)
    found = _scale_like_coupling()
    assert _named(found) == [other]
    doubted = next(i for i, each in enumerate(found.rounds) if each.removed == first)
    later = [trial.key for each in found.rounds[doubted + 1 :] for trial in each.trials]
    assert other in later
    assert first not in later


class _Interrupted(ToyProblem):
    after = 3

    def residual(self, model: Extension) -> Floats:
        if self.calls == self.after:
            raise KeyboardInterrupt
        return super().residual(model)


def test_an_interrupt_keeps_what_was_found() -> None:
    rng = np.random.default_rng(3)
    whole = toy(rng, {"bend": {"q1_bend": 0.3}, "play": {"q2_play": 2.0}})
    for after in (1, 3, 8, 12, 16, 20):
        problem = _Interrupted(whole.setpoints, whole.measured)
        problem.after = after
        found = diagnose(problem, np.random.default_rng(0))
        assert not found.complete
        assert any("interrupted" in warning for warning in found.verdict.warnings)
        assert np.isfinite(found.residual_before).any()
        # What was fitted is not known to the last digit, whenever the interrupt came.
        for cause in found.verdict.causes:
            for estimate in cause.parameters.values():
                low, high = estimate.interval90
                assert low <= estimate.value <= high
                assert low < high
    assert _named(found)


def test_a_model_that_the_twin_cannot_follow_is_no_candidate() -> None:
    class Refusing(ToyProblem):
        def residual(self, model: Extension) -> Floats:
            found = super().residual(model)
            return np.full_like(found, np.nan) if "scale" in model else found

    rng = np.random.default_rng(3)
    whole = toy(rng, {"scale": {"q1_scale": 0.5}})
    found = diagnose(Refusing(whole.setpoints, whole.measured), rng)
    assert not any(cause.effect == "scale" for cause in found.verdict.causes)


def test_gain_beyond_the_range_and_its_loss_are_reported() -> None:
    rng = np.random.default_rng(8)
    hidden: Hidden = {"scale": {"q1_scale": 0.5}}
    problem = toy(rng, hidden, ar=(0.5,))
    wider = toy(rng, hidden, ar=(0.5,), length=500)
    opposite = toy(rng, {"scale": {"q1_scale": -0.5}}, ar=(0.5,), length=500)
    found = diagnose(problem, rng, beyond_range=wider, new_grasp=opposite)
    assert found.verdict.gain.beyond_range is not None
    assert found.verdict.gain.beyond_range > 0.9
    assert found.verdict.gain.new_grasp is not None
    assert found.verdict.gain.new_grasp < 0.0
    assert any("worse than the plain one at the new grasp" in w for w in found.verdict.warnings)


def test_samples_that_do_not_fit_the_residual_are_refused() -> None:
    class Short(ToyProblem):
        def residual(self, model: Extension) -> Floats:
            return super().residual(model)[:-1]

    whole = toy(np.random.default_rng(0), {}, length=100)
    with pytest.raises(ValueError, match="299 numbers and its samples label 300"):
        diagnose(Short(whole.setpoints, whole.measured), np.random.default_rng(0))


def test_order_in_what_is_left_beside_a_name_is_told() -> None:
    rng = np.random.default_rng(3)
    hidden: Hidden = {"scale": {"q1_scale": 0.8}, "bend": {"q1_bend": 0.1}}
    problem = toy(rng, hidden, leave_out=("bend", "coupling", "play"))
    easily_pleased = Settings(outside_share=0.99)
    found = diagnose(problem, np.random.default_rng(0), settings=easily_pleased)
    assert found.verdict.verdict == "named"
    assert any("is not without order" in warning for warning in found.verdict.warnings)
    plain = toy(np.random.default_rng(3), {"scale": {"q1_scale": 0.8}})
    rightly = diagnose(plain, np.random.default_rng(0)).verdict
    assert rightly.verdict == "named"
    assert not any("is not without order" in warning for warning in rightly.warnings)


def test_what_brings_the_error_no_nearer_to_the_noise_is_not_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A cause may be clear in numbers that are off by no more than their sensors scatter."""
    problem = toy(np.random.default_rng(3), {"scale": {"q1_scale": 0.8}})
    assert _named(diagnose(problem, np.random.default_rng(0))) == ["scale@q1"]

    def in_place(before: Floats, after: Floats, samples: Samples) -> float:
        return 0.01

    monkeypatch.setattr(verdict_building, "removed_share", in_place)
    found = diagnose(problem, np.random.default_rng(0)).verdict
    assert found.verdict == "nothing"
    assert (found.causes, found.ambiguous, found.gain.in_range) == ((), (), None)
