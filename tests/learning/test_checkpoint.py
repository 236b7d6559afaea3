"""A training goes on only from a whole checkpoint of itself."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from defras_bt.learning.networks.hole_features import FRAME_CHANNELS, FRAMES, HOLE_CHANNELS
from defras_bt.learning.networks.weights import NetworkName
from defras_bt.learning.training.checkpoint import OtherTraining, UnusableCheckpoint
from defras_bt.learning.training.encoding import SIDE, About, Encoded, Part
from defras_bt.learning.training.loop import Settings, Training
from defras_bt.learning.training.trainable import trainable

SAMPLES = 2
SETTINGS = Settings(epochs=2, batch=2)


def data(seed: int) -> Encoded:
    """Random numbers in the shapes of the sequence network's data."""
    rng = np.random.default_rng(seed)
    holes = (SAMPLES, SIDE * SIDE)
    about = About("00000/0", "attachments", "as planned", "slab", 0.004, FRAMES, 0.1)
    frames = rng.normal(size=(SAMPLES, FRAMES, len(FRAME_CHANNELS), SIDE, SIDE))
    return Encoded(
        inputs={
            "frames": frames.astype(np.float16),
            "known": np.ones((SAMPLES, FRAMES), bool),
            "holes": rng.random((SAMPLES, len(HOLE_CHANNELS), SIDE, SIDE)).astype(np.float16),
        },
        truth=rng.random(holes) < 0.5,
        believed=rng.random(holes) < 0.5,
        is_hole=np.ones(holes, bool),
        grasp_m=np.full(holes, 0.02),
        about=[about] * SAMPLES,
    )


def training(
    folder: Path,
    *,
    width: int = 8,
    form: str = "grid",
    network: NetworkName = "sequence",
    seed: int = 0,
    settings: Settings = SETTINGS,
    resume: bool = True,
) -> Training:
    torch.manual_seed(0)
    config = {"form": form, "width": width} if network == "sequence" else {"width": width}
    parts: dict[Part, Encoded] = {"training": data(seed), "validation": data(seed + 1)}
    return Training(folder, trainable(network, config), settings, parts, resume=resume)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """With the checkpoint of one epoch of two."""
    next(training(tmp_path, resume=False).epochs())
    return tmp_path


def test_the_same_training_goes_on(folder: Path) -> None:
    going_on = training(folder)
    assert [epoch.number for epoch in going_on.history] == [1]
    assert [epoch.number for epoch in going_on.epochs()] == [2]
    assert [file.name for file in folder.glob("*.safetensors")] == ["checkpoint-2.safetensors"]


def test_another_training_is_refused_and_told_apart(folder: Path) -> None:
    with pytest.raises(OtherTraining, match=r"other network: SequenceNetwork of \d+ numbers"):
        training(folder, width=16)
    with pytest.raises(OtherTraining, match="other network"):
        training(folder, form="points")
    with pytest.raises(OtherTraining, match="asked for is VoxelNetwork"):
        training(folder, network="banet")
    with pytest.raises(OtherTraining, match="other data: 2 of training and 2 of validation"):
        training(folder, seed=5)
    with pytest.raises(OtherTraining, match="other settings"):
        training(folder, settings=replace(SETTINGS, rate=1e-3))


def _cut(file: Path) -> None:
    file.write_bytes(file.read_bytes()[:50])


def _list(file: Path) -> None:
    file.write_text("[]")


def _without_history(file: Path) -> None:
    content = json.loads(file.read_text())
    del content["history"]
    file.write_text(json.dumps(content))


@pytest.mark.parametrize(
    ("name", "damage"),
    [
        ("checkpoint.json", _cut),
        ("checkpoint.json", _list),
        ("checkpoint.json", _without_history),
        ("checkpoint-1.safetensors", _cut),
        ("checkpoint-1.safetensors", Path.unlink),
    ],
)
def test_a_broken_checkpoint_is_refused(
    folder: Path, name: str, damage: Callable[[Path], None]
) -> None:
    damage(folder / name)
    with pytest.raises(UnusableCheckpoint, match="start without --resume"):
        training(folder)
