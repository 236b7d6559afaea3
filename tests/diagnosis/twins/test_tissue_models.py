"""Models are led along once, however many are asked for."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.diagnosis.problem import Integers
from defras_bt.diagnosis.recording_reader import read_recording
from defras_bt.diagnosis.twins import tissue_models
from defras_bt.diagnosis.twins.tissue_correction import finer
from defras_bt.diagnosis.twins.tissue_frames import TissueFrames, frames_of, led_along
from defras_bt.diagnosis.twins.tissue_keyframes import keyframes
from defras_bt.diagnosis.twins.tissue_models import LedModels
from defras_bt.diagnosis.twins.tissue_trajectory import Trajectory, trajectory
from defras_sim.effects.effect import Extension
from defras_sim.geometry import Floats
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


def test_the_meshs_error_is_computed_anew_for_what_was_accepted(
    scene: Scene, way: Trajectory
) -> None:
    heavy: Extension = {"gravity": {"acceleration_m_s2": 2.0}}
    both: Extension = {**heavy, "stiffness": {"scale": 1.2}}
    models = LedModels(scene, [way], {}, jobs=1)
    plain, before = models.frames({}), models.frames(both)
    assert models.correct_at(heavy)
    after = models.frames(heavy)
    fine = finer(scene)
    assert fine is not None
    predicted = led_along(fine, heavy, way)
    assert plain is not None
    assert before is not None
    assert after is not None
    assert predicted is not None
    expected = frames_of(predicted, fine, heavy, way)
    bare = models.uncorrected(heavy)
    assert bare is not None
    chosen = keyframes(way).chosen
    # The fine mesh was solved at fewer instants, on a way of its own.
    assert _apart_m(after[0], expected, chosen) < 0.3 * _apart_m(bare[0], expected, chosen)
    changed, again = models.frames(both), models.frames({})
    assert changed is not None
    assert again is not None
    last = chosen[-1]
    assert np.array_equal(_vertices(plain[0], last), _vertices(again[0], last))
    assert not np.array_equal(_vertices(before[0], last), _vertices(changed[0], last))


def test_a_camera_that_stands_elsewhere_changes_no_mesh(scene: Scene, way: Trajectory) -> None:
    models = LedModels(scene, [way], {}, jobs=1)
    assert not models.correct_at({})
    assert not models.correct_at({"camera_registration": {"x_m": 0.002}})


def _apart_m(one: TissueFrames, other: TissueFrames, chosen: Integers) -> float:
    apart = [_vertices(one, index) - _vertices(other, index) for index in chosen]
    return float(np.sqrt(np.mean(np.square(apart))))


def _vertices(frames: TissueFrames, index: int) -> Floats:
    surface = frames.surfaces[index]
    assert surface is not None
    return surface.vertices_m
