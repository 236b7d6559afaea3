"""Models are led along once, however many are asked for."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.diagnosis.recording_reader import read_recording
from defras_bt.diagnosis.twins import tissue_models
from defras_bt.diagnosis.twins.tissue_frames import led_along
from defras_bt.diagnosis.twins.tissue_models import LedModels
from defras_bt.diagnosis.twins.tissue_trajectory import Trajectory, trajectory
from defras_sim.effects.effect import Extension
from defras_sim.prediction import Prediction
from defras_sim.scene import Scene
from tests.diagnosis.twins.tissue_twin_data import SCRIPT, coarse, recorded

MODELS = [{"stiffness": {"scale": 1.0 + 0.1 * number}} for number in range(1, 21)]


@pytest.fixture(scope="module")
def scene() -> Scene:
    return coarse()


@pytest.fixture(scope="module")
def way(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Trajectory:
    file = recorded(scene, {}, tmp_path_factory.mktemp("r") / "null.mcap")
    return trajectory(read_recording(file, scene), scene)


def test_frames_that_are_not_solved_lie_on_the_way_between_those_that_are(
    scene: Scene, way: Trajectory
) -> None:
    assert len(np.setdiff1d(way.frames, way.solved)) > 10
    sparse = led_along(scene, {}, way)
    dense = led_along(scene, {}, way, way.frames)
    assert sparse is not None
    assert dense is not None
    worst_m = []
    for time_s in way.time_s:
        one, other = (each.surface_shown(float(time_s)).vertices_m for each in (sparse, dense))
        worst_m.append(np.linalg.norm(one - other, axis=1).max())
    # Where tissue snaps over, one frame between two solved ones is off by more.
    assert np.quantile(worst_m, 0.95) < 1e-4
    assert max(worst_m) < 1e-3
    forces = [each.force_between_n(SCRIPT.arm, way.time_s) for each in (sparse, dense)]
    assert np.abs(forces[0] - forces[1]).max() < 0.02 * np.abs(forces[1]).max()


@pytest.mark.parametrize(("room", "times"), [(10**9, 1), (1, 2)])
def test_each_model_is_led_along_once_where_there_is_room(
    scene: Scene,
    way: Trajectory,
    monkeypatch: pytest.MonkeyPatch,
    room: int,
    times: int,
) -> None:
    plain = led_along(scene, {}, way)
    asked: list[Extension] = []

    def known(scene: Scene, model: Extension, *_: object) -> Prediction | None:
        asked.append(model)
        return plain

    monkeypatch.setattr(tissue_models, "led_along", known)
    monkeypatch.setattr(tissue_models, "_REMEMBERED_BYTES", room)
    models = LedModels(scene, [way], {}, jobs=1)
    del asked[:]
    for model in (*MODELS, *MODELS):
        assert models.frames(model) is not None
    assert len(asked) == times * len(MODELS)
