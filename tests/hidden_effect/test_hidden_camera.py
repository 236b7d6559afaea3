from __future__ import annotations

from tests.hidden_effect.hidden_retractions import FARTHER, Laboratory


def test_a_displaced_camera_is_named_measured_and_put_right(laboratory: Laboratory) -> None:
    hidden = {"camera_registration": {"x_m": 0.002, "z_m": 0.003, "turn_y_rad": -0.03}}
    data = laboratory.recording(hidden, seed=6)
    farther = laboratory.recording(hidden, seed=7, script=FARTHER)
    verdict = laboratory.verdict(data, "--held-out", str(farther))
    assert verdict["verdict"] == "named"
    (cause,) = verdict["causes"]
    assert cause["effect"] == "camera_registration"
    for name, truth in hidden["camera_registration"].items():
        low, high = cause["parameters"][name]["interval90"]
        assert low <= truth <= high, name
    assert verdict["gain"]["in_range"] > 0.8
    assert verdict["gain"]["beyond_range"] > 0.6
    assert verdict["gain"]["new_grasp"] is None
    assert set(laboratory.extended().model.extension) == {"camera_registration"}
