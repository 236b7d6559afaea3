"""One training from the data's folder to weights with their card."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import torch

from defras_bt.learning.data.generate import read_manifest, shard_files
from defras_bt.learning.data.shards import FORMAT, InvalidData
from defras_bt.learning.networks.weights import NetworkName, write_weights
from defras_bt.learning.training.card import model_card
from defras_bt.learning.training.encoding import PARTS, Encoded, Part, encoded
from defras_bt.learning.training.loop import Settings, Training
from defras_bt.learning.training.trainable import trainable


def train_network(
    name: NetworkName,
    config: Mapping[str, Any],
    data: Path,
    out: Path,
    settings: Settings,
    *,
    threads: int,
    resume: bool,
    tell: Callable[[str], None],
) -> Mapping[str, Any]:
    """Train on the data in folder ``data``; weights and card are written to ``out``.

    The card is returned. ``tell`` hears a sentence after each epoch.

    Raises:
        InvalidData: the folder holds too little data, none, or data that cannot be read.
        UnusableCheckpoint: with ``resume``, the checkpoint in ``out`` is of another training, or
            cannot be read.
    """
    torch.set_num_threads(threads)
    asked = read_manifest(data)
    tell("Reading the data.")
    parts = encoded(data, name, lambda done, of: None)
    _require_all(parts, data)
    torch.manual_seed(settings.seed)
    model = trainable(name, config)
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    model.network.to(device)
    if device.type == "cuda":
        tell(f"Training on {torch.cuda.get_device_name(device)}.")
    training = Training(out, model, settings, parts, resume=resume)
    for epoch in training.epochs():
        tell(
            f"Epoch {epoch.number} of {settings.epochs}: training {epoch.training_loss:.4f}, "
            f"validation {epoch.validation_loss:.4f} (best {epoch.best_loss:.4f}), "
            f"{epoch.seconds:.0f} s"
        )
    model.network.load_state_dict(training.best)
    known = {
        "format": FORMAT,
        "seed": asked.seed,
        "tissues": len(shard_files(data)),
    }
    card = model_card(name, config, model, parts, settings, training.history, known)
    write_weights(out, name, training.best, card)
    return card


def _require_all(parts: Mapping[Part, Encoded], data: Path) -> None:
    missing = [part for part in PARTS if part not in parts]
    if missing:
        raise InvalidData(
            f"{data} has too few shards to be divided: none is left for {', '.join(missing)}; "
            "make at least 8 shards: defras train data --samples 500"
        )
