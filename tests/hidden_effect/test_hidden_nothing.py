from __future__ import annotations

from tests.hidden_effect.hidden_retractions import Laboratory


def test_nothing_is_named_where_nothing_is_hidden(laboratory: Laboratory) -> None:
    verdict = laboratory.verdict(laboratory.recording({}, seed=5))
    assert verdict["verdict"] == "nothing"
    assert verdict["causes"] == []
    # What was not found is limited: a camera could not have been centimetres off unnoticed.
    assert verdict["excluded"]["camera_registration"]["strength"] < 0.01
    assert not laboratory.extended().model.extension
