from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from defras_bt.diagnosis.layout import layout
from defras_bt.diagnosis.problem import Candidate
from defras_bt.diagnosis.recording import RecordedRun
from defras_bt.diagnosis.recording_reader import UnusableRecording, read_recording
from defras_bt.diagnosis.twins.tissue import TissueProblem
from defras_bt.diagnosis.twins.tissue_candidates import tissue_candidates
from defras_sim.effects.grasp_slip import SLIDING_S
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from tests.diagnosis.twins.tissue_twin_data import coarse, recorded

CANDIDATES = {c.key: c for c in tissue_candidates()}


@pytest.fixture(scope="module")
def scene() -> Scene:
    return coarse()


@pytest.fixture(scope="module")
def run(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> RecordedRun:
    return read_recording(recorded(scene, {}, tmp_path_factory.mktemp("r") / "null.mcap"), scene)


@pytest.fixture(scope="module")
def problem(scene: Scene, run: RecordedRun) -> TissueProblem:
    return TissueProblem(scene, [run], tuple(CANDIDATES.values()), most_frames=60)


def in_tolerances(problem: TissueProblem, residual: Floats) -> Floats:
    channels = problem.samples.channels
    tolerance = np.array([np.hypot(c.noise_sd, c.floor) for c in channels])
    return residual / tolerance[problem.samples.channel]


def test_samples_are_labelled_as_the_engine_wants_them(problem: TissueProblem) -> None:
    samples = problem.samples
    assert layout(samples).size == len(problem.residual({}))
    assert {c.sensor for c in samples.channels} == {"cloud", "force", "tip"}
    phases = {samples.phases[i] for i in np.unique(samples.phase)}
    assert phases >= {"rest", "pull", "hold", "fold", "after release"}
    assert 6 <= len(np.unique(samples.fold)) <= 10
    for fold in np.unique(samples.fold):
        times = np.unique(samples.time_s[samples.fold == fold])
        others = samples.time_s[samples.fold != fold]
        assert not np.any((others > times[0]) & (others < times[-1]))


def test_noise_is_what_the_sensors_scatter(problem: TissueProblem) -> None:
    found: dict[str, list[float]] = {"cloud": [], "force": [], "tip": []}
    for channel in problem.samples.channels:
        found[channel.sensor].append(channel.noise_sd)
    # Points scatter by 0.6 mm; a patch is the mean of some twenty, of the picture's error beside.
    assert 0.0001 < np.median(found["cloud"]) < 0.0004
    assert np.median(found["tip"]) == pytest.approx(2e-5, rel=0.4)
    assert 0.0005 < np.median(found["force"]) < 0.004


def test_without_a_hidden_cause_the_plain_model_agrees(problem: TissueProblem) -> None:
    assert np.nanmean(in_tolerances(problem, problem.residual({})) ** 2) < 1.5


def test_the_same_numbers_are_compared_whatever_the_model(problem: TissueProblem) -> None:
    seen = np.isfinite(problem.residual({}))
    for model in ({"stiffness": {"scale": 1.3}}, {"camera_registration": {"z_m": 0.004}}):
        assert np.array_equal(np.isfinite(problem.residual(model)), seen)


def test_a_uniform_stiffness_shows_in_forces_alone(problem: TissueProblem) -> None:
    change = problem.residual({"stiffness": {"scale": 1.2}}) - problem.residual({})
    by_sensor = np.array([c.sensor for c in problem.samples.channels])[problem.samples.channel]
    stretched = np.abs(in_tolerances(problem, change))
    assert np.nanmax(stretched[by_sensor == "force"]) > 1.0
    assert np.nanpercentile(stretched[by_sensor == "cloud"], 99) < 0.3


TANGENTS: Mapping[str, tuple[int, float, float]] = {
    # key: which tangent, how alike the full model's change it is, how far off it may be
    "camera_registration": (0, 0.94, 0.35),
    "depth_bias": (0, 0.98, 0.1),
    "camera_latency": (0, 0.75, 0.7),
    "grasp_offset": (0, 0.95, 0.3),
    "tool_offset": (0, 0.95, 0.3),
    "joint_offset@shaft": (0, 0.9, 0.4),
    "stiffness": (0, 0.95, 0.3),
    "stress_relaxation": (1, 0.8, 0.6),
    "missing_attachment": (5, 0.98, 0.4),
}


@pytest.mark.parametrize("key", TANGENTS)
def test_tangents_foretell_what_the_full_model_does(problem: TissueProblem, key: str) -> None:
    number, alike, off = TANGENTS[key]
    candidate = CANDIDATES[key]
    tangent = problem.tangents({}, candidate)[number]
    amplitudes = np.zeros(len(tangent.steps))
    amplitudes[0] = 1.0
    values = tangent.values(amplitudes, candidate.free)
    change = problem.residual({}) - problem.residual({candidate.effect.name: values})
    true, told = (in_tolerances(problem, c) for c in (change, tangent.columns @ amplitudes))
    known = np.isfinite(true) & np.isfinite(told)
    assert np.corrcoef(true[known], told[known])[0, 1] > alike
    size = np.sqrt(np.mean(true[known] ** 2))
    assert np.sqrt(np.mean((true - told)[known] ** 2)) < off * size


def test_a_slip_shows_at_once(problem: TissueProblem) -> None:
    """Tissue jumps within a frame or two: what would be spread to the next keyframe dates it wrong,
    and is hardly seen where noise remembers."""
    candidate = CANDIDATES["grasp_slip"]
    tangents = problem.tangents({}, candidate)
    tangent = tangents[len(tangents) // 2]
    values = tangent.values(np.ones(1), candidate.free)
    since_s = problem.samples.time_s - values["time_s"]
    just_after = (since_s > SLIDING_S) & (since_s < SLIDING_S + 0.5)
    assert just_after.any()
    true = problem.residual({}) - problem.residual({"grasp_slip": values})
    told = tangent.columns[:, 0]
    by_sensor = np.array([c.sensor for c in problem.samples.channels])[problem.samples.channel]
    for sensor in ("cloud", "force"):
        known = just_after & (by_sensor == sensor) & np.isfinite(true)
        size = np.sqrt(np.mean(true[known] ** 2))
        assert np.sqrt(np.mean((true - told)[known] ** 2)) < 0.45 * size, sensor
        before = (since_s < 0.0) & (by_sensor == sensor)
        assert np.abs(told[before]).max() == 0.0


def test_every_candidate_has_a_way_to_begin(problem: TissueProblem) -> None:
    rows = len(problem.samples.time_s)
    for candidate in CANDIDATES.values():
        tangents = problem.tangents({}, candidate)
        assert tangents, candidate.key
        for tangent in tangents:
            assert tangent.columns.shape == (rows, len(tangent.steps))
            nowhere = tangent.values(np.zeros(len(tangent.steps)), candidate.free)
            assert set(nowhere) == {p.name for p in candidate.free}, candidate.key


def test_a_scene_without_the_grasped_tissue_is_refused(scene: Scene, run: RecordedRun) -> None:
    small = scene.tissue.model_copy(update={"length_x_m": 0.02, "width_y_m": 0.02})
    maps = scene.attachments.model_copy(update={"map": ("..",) * 2})
    elsewhere = scene.model_copy(update={"tissue": small, "attachments": maps})
    with pytest.raises(UnusableRecording, match="cannot repeat a grasp"):
        TissueProblem(elsewhere, [run], ())


def test_an_effect_that_is_not_there_cannot_be_left_out() -> None:
    with pytest.raises(ValueError, match="no effect stifness"):
        tissue_candidates(["stifness"])
    left: tuple[Candidate, ...] = tissue_candidates(["stiffness"])
    assert "stiffness" not in {c.effect.name for c in left}
