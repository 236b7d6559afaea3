"""A tiny version of all of it: patients, data, training, weights; it beats the belief alone."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from defras_bt.learning.data.coverage import write_coverage
from defras_bt.learning.data.episode import TissueModels, draw_episode
from defras_bt.learning.data.generate import Request, missing_shards, open_manifest
from defras_bt.learning.data.patients import draw_patient
from defras_bt.learning.data.samples import samples_of
from defras_bt.learning.data.shards import (
    FORMAT,
    UNIT_M,
    InvalidData,
    packed,
    read_shard,
    unpacked,
    write_shard,
)
from defras_bt.learning.networks.propose import proposer
from defras_bt.learning.networks.weights import NoWeights, read_weights
from defras_bt.learning.training.checkpoint import OtherTraining
from defras_bt.learning.training.loop import Settings
from defras_bt.learning.training.run import train_network
from defras_sim.scene import Attachments, Roi, Scene, Simulation, Tissue

SHARDS, PATIENTS = 8, 3


@pytest.fixture(scope="module")
def tissue() -> Scene:
    """Small and coarse, so that a patient takes a fraction of a second."""
    return Scene(
        name="tiny",
        tissue=Tissue(length_x_m=0.08, width_y_m=0.08, elements_xyz=(4, 4, 1)),
        attachments=Attachments(map=("........",) * 8),
        roi=Roi(center_x_m=0.0, center_y_m=0.0),
        simulation=Simulation(elements_xyz=(5, 5, 1)),
    )


@pytest.fixture(scope="module")
def folder(tissue: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Data of one tissue, divided as if it were of several."""
    out = tmp_path_factory.mktemp("data")
    (out / "shards").mkdir()
    open_manifest(out, Request(0, 100))
    models = TissueModels(tissue)
    for number in range(SHARDS):
        rng = np.random.default_rng([7, number])
        drawn = (draw_episode(models, draw_patient(tissue, rng), rng) for _ in range(PATIENTS))
        episodes = [episode for episode in drawn if episode is not None]
        write_shard(out / "shards" / f"{number:05}.npz", tissue, models.rest, episodes)
    return out


def train(folder: Path, out: Path, epochs: int, *, resume: bool = False) -> dict[str, object]:
    settings = Settings(seed=1, epochs=epochs, batch=8, rate=4e-3)
    config = {"form": "grid", "width": 16}
    card = train_network(
        "sequence", config, folder, out, settings, threads=1, resume=resume, tell=lambda s: None
    )
    return dict(card)


@pytest.fixture(scope="module")
def trained(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("trained")
    train(folder, out, 8)
    return out


def test_it_beats_what_the_belief_alone_says(trained: Path) -> None:
    metrics = json.loads((trained / "sequence.json").read_text())["metrics"]
    assert metrics["all"]["cross_entropy"] < 0.9 * metrics["belief alone"]["cross_entropy"]


def test_weights_are_read_without_pickle_and_propose(trained: Path, folder: Path) -> None:
    proposing = proposer(read_weights("sequence", trained))
    sample = next(samples_of(read_shard(folder / "shards" / "00007.npz")))
    said = proposing.propose(sample.belief, sample.keyframes, sample.predicted)
    assert said is not None
    assert said.probability.shape == sample.belief.attached.shape
    assert ((said.probability >= 0) & (said.probability <= 1)).all()
    assert (said.uncertainty >= 0).all()
    again = proposing.propose(sample.belief, sample.keyframes, sample.predicted)
    assert again is not None
    np.testing.assert_array_equal(said.probability, again.probability)


def test_changed_weights_are_refused(trained: Path, tmp_path: Path) -> None:
    for name in ("sequence.json", "sequence.safetensors"):
        (tmp_path / name).write_bytes((trained / name).read_bytes())
    content = bytearray((tmp_path / "sequence.safetensors").read_bytes())
    content[-1] ^= 1
    (tmp_path / "sequence.safetensors").write_bytes(content)
    with pytest.raises(NoWeights, match="not what its card describes"):
        read_weights("sequence", tmp_path)


def test_missing_weights_say_how_to_get_them(tmp_path: Path) -> None:
    with pytest.raises(NoWeights, match="defras train banet"):
        read_weights("banet", tmp_path)


def test_an_interrupted_training_ends_in_the_same_weights(folder: Path, tmp_path: Path) -> None:
    whole, halved = tmp_path / "whole", tmp_path / "halved"
    train(folder, whole, 2)
    # What is there after one of two epochs: trained again from the start, cut after the first.
    state = json.loads((whole / "checkpoint.json").read_text())
    assert len(state["history"]) == 2
    stopped = _first_epoch(folder, halved)
    assert stopped == 1
    train(folder, halved, 2, resume=True)
    one, other = ((out / "sequence.safetensors").read_bytes() for out in (whole, halved))
    assert one == other


def _first_epoch(folder: Path, out: Path) -> int:
    """Train as :func:`train` does with two epochs, but only the first; how many were done."""
    import torch

    from defras_bt.learning.training.encoding import encoded
    from defras_bt.learning.training.loop import Training
    from defras_bt.learning.training.trainable import trainable

    settings = Settings(seed=1, epochs=2, batch=8, rate=4e-3)
    torch.manual_seed(settings.seed)
    model = trainable("sequence", {"form": "grid", "width": 16})
    parts = encoded(folder, "sequence", lambda done, of: None)
    training = Training(out, model, settings, parts, resume=False)
    next(training.epochs())
    return len(training.history)


def test_a_checkpoint_of_another_training_is_refused(folder: Path, trained: Path) -> None:
    with pytest.raises(OtherTraining, match="start without --resume"):
        train(folder, trained, 3, resume=True)


def test_shards_are_read_back_as_they_were_drawn(tissue: Scene, folder: Path) -> None:
    models = TissueModels(tissue)
    rng = np.random.default_rng([7, 0])
    patient = draw_patient(tissue, rng)
    episode = draw_episode(models, patient, rng)
    assert episode is not None
    read = read_shard(folder / "shards" / "00000.npz").patients[0]
    assert read.scene == patient
    assert read.cause == episode.cause
    for one, other in zip(read.grasps, episode.grasps, strict=True):
        for seen, drawn in zip(one.clouds_m, other.clouds_m, strict=True):
            np.testing.assert_allclose(seen, drawn, atol=0.51 * UNIT_M)
        for walk, walked in zip(one.walks, other.walks, strict=True):
            np.testing.assert_array_equal(walk.attached, walked.attached)
            np.testing.assert_allclose(walk.vertices_m, walked.vertices_m, atol=0.51 * UNIT_M)


def test_what_does_not_fit_a_shard_is_refused() -> None:
    places = np.array([[0.0, 0.1, -0.32]])
    np.testing.assert_allclose(unpacked(packed(places)), places)
    with pytest.raises(ValueError, match="within 327 mm"):
        packed(places + 0.4)


def test_labels_of_other_causes_are_the_belief(folder: Path) -> None:
    samples = [
        s for n in range(SHARDS) for s in samples_of(read_shard(folder / f"shards/{n:05}.npz"))
    ]
    assert {s.cause for s in samples} >= {"attachments"}
    for sample in samples:
        same = np.array_equal(sample.belief.attached, sample.truth.attached)
        assert same == (sample.cause != "attachments")
        assert len(sample.keyframes) == len(sample.predicted.surfaces)
        stamps = [frame.stamp_s for frame in sample.keyframes]
        assert stamps == sorted(stamps)


def test_the_report_counts_every_sample(folder: Path) -> None:
    told: list[int] = []
    coverage = write_coverage(folder, lambda done, of: told.append(done))
    assert told == list(range(1, SHARDS + 1))
    said = json.loads((folder / "coverage.json").read_text())
    assert said["samples"] == coverage.samples == sum(said["counts"]["belief"].values())
    assert "<img" in (folder / "coverage.html").read_text()


def test_data_of_another_seed_is_not_mixed_in(folder: Path) -> None:
    open_manifest(folder, Request(0, 500))
    with pytest.raises(InvalidData, match="choose another folder"):
        open_manifest(folder, Request(1, 100))
    open_manifest(folder, Request(0, 100))
    assert missing_shards(folder, Request(0, 400)) == []
    assert json.loads((folder / "manifest.json").read_text())["format"] == FORMAT
