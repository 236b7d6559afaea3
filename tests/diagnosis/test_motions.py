"""The motion that separates two causes, and the force that forbids it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from defras_bt.diagnosis.confounding import structural_confounding
from defras_bt.diagnosis.motions import separating_motions
from defras_sim.geometry import Floats
from tests.diagnosis.toy_problem import ToyProblem, wander

STRENGTHS = {"scale@q1": {"q1_scale": 0.5}, "coupling@q1_from_q2": {"q1_from_q2": 0.5}}


@dataclass
class Planned(ToyProblem):
    sentence: str = ""
    peak_force_n: float = 0.1


def _planned(setpoint: Floats, sentence: str, peak_force_n: float) -> Planned:
    return Planned([setpoint], [setpoint], sentence=sentence, peak_force_n=peak_force_n)


def _motions() -> list[Planned]:
    rng = np.random.default_rng(2)
    apart = wander(rng, 400, 2)
    same = np.repeat(apart[:, :1], 2, axis=1)
    nearly = np.stack((apart[:, 0], apart[:, 0] + 0.1 * apart[:, 1]), axis=1)
    return [
        _planned(same, "both together", 0.1),
        _planned(nearly, "nearly together", 0.2),
        _planned(apart, "each by itself", 0.4),
    ]


def test_the_motion_that_moves_both_apart_is_first_and_a_forbidden_one_is_left_out() -> None:
    found = separating_motions(_motions(), {}, STRENGTHS, 0.5)
    assert [one.motion.sentence for one in found] == [
        "each by itself",
        "nearly together",
        "both together",
    ]
    assert found[0].separation > 5.0 * found[1].separation
    assert found[2].separation == pytest.approx(0.0, abs=1e-6)
    allowed = separating_motions(_motions(), {}, STRENGTHS, 0.3)
    assert [one.motion.sentence for one in allowed] == ["nearly together", "both together"]


def test_fewer_independent_samples_separate_less() -> None:
    whole = separating_motions(_motions(), {}, STRENGTHS, 0.5)[0].separation
    quarter = separating_motions(_motions(), {}, STRENGTHS, 0.5, independent_share=0.25)
    assert quarter[0].separation == pytest.approx(0.5 * whole)


def test_one_cause_alone_or_an_unknown_one_is_refused() -> None:
    with pytest.raises(ValueError, match="takes two"):
        separating_motions(_motions(), {}, {"scale@q1": {}}, 1.0)
    with pytest.raises(ValueError, match="has no candidate slip"):
        separating_motions(_motions(), {}, {"scale@q1": {}, "slip": {}}, 1.0)


def test_confounding_is_known_before_any_data() -> None:
    together, nearly, apart = (structural_confounding(motion, {}) for motion in _motions())

    def cosine(found) -> float:
        keys = found.keys
        pair = keys.index("scale@q1"), keys.index("coupling@q1_from_q2")
        return float(found.cosine[pair])

    assert cosine(together) == pytest.approx(1.0)
    assert 0.9 < cosine(nearly) < 1.0
    assert cosine(apart) < 0.5
    assert together.shift[together.keys.index("ghost")] == 0.0
