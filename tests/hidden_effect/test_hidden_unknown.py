from __future__ import annotations

from tests.hidden_effect.hidden_retractions import Laboratory


def test_what_the_library_lacks_is_not_called_by_another_name(laboratory: Laboratory) -> None:
    hidden = {"camera_registration": {"turn_x_rad": 0.04, "turn_y_rad": -0.04}}
    data = laboratory.recording(hidden, seed=8)
    verdict = laboratory.verdict(data, "--without", "camera_registration")
    assert verdict["verdict"] == "outside"
    assert verdict["causes"] == []
    assert verdict["unexplained_share"] > 0.25
    assert not laboratory.extended().model.extension
