"""The state of a training on disk: numbers as JSON, tensors as safetensors, neither ever half."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from safetensors import SafetensorError
from safetensors.torch import load_file, save_file
from torch import Tensor, nn

from defras_bt.learning.training.encoding import Encoded, Part

NAME = "checkpoint.json"

Identity = Mapping[str, Any]
"""What has to be the same for a training to go on: ``settings``, ``network``, ``data``."""


@dataclass(frozen=True)
class Epoch:
    """One line of the history. Losses in nats a hole."""

    number: int
    training_loss: float
    validation_loss: float
    best_loss: float
    seconds: float


class UnusableCheckpoint(ValueError):
    """A training cannot go on from the checkpoint in its folder."""


class OtherTraining(UnusableCheckpoint):
    """The checkpoint in a folder is of other settings, of another network or of other data."""


def write_checkpoint(
    folder: Path, identity: Identity, tensors: Mapping[str, Tensor], history: Sequence[Epoch]
) -> None:
    """Replace the checkpoint in one step: the JSON, which names its tensors, comes last."""
    tensor_file = f"checkpoint-{len(history)}.safetensors"
    content = {name: tensor.cpu().contiguous() for name, tensor in tensors.items()}
    save_file(content, folder / tensor_file)
    said = {**identity, "tensors": tensor_file, "history": [asdict(epoch) for epoch in history]}
    partial = (folder / NAME).with_suffix(".part")
    partial.write_text(json.dumps(said, indent=1) + "\n", encoding="utf-8")
    os.replace(partial, folder / NAME)
    for old in folder.glob("checkpoint-*.safetensors"):
        if old.name != tensor_file:
            old.unlink()


def read_checkpoint(folder: Path, identity: Identity) -> tuple[dict[str, Tensor], list[Epoch]]:
    """The tensors and the history in ``folder``.

    Raises:
        OtherTraining: they are not of ``identity``.
        UnusableCheckpoint: a file is cut, missing or something else.
    """
    file = folder / NAME
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        _require_same(file, content, identity)
        history = [Epoch(**epoch) for epoch in content["history"]]
        return load_file(folder / content["tensors"]), history
    except OtherTraining:
        raise
    except (AttributeError, KeyError, TypeError, ValueError, OSError, SafetensorError) as error:
        raise UnusableCheckpoint(
            f"{file} or the tensors that it names cannot be read ({type(error).__name__}: "
            f"{error}): start without --resume, or in another folder"
        ) from error


def _require_same(file: Path, content: Mapping[str, Any], identity: Identity) -> None:
    for what, asked in identity.items():
        known = content.get(what)
        if known != asked:
            raise OtherTraining(
                f"{file} is of a training with other {what}: {known}; asked for is {asked}: start "
                "without --resume, or in another folder"
            )


def described_network(network: nn.Module) -> str:
    """A network by its class, its size, and the names and shapes of all its numbers."""
    shapes = {name: list(tensor.shape) for name, tensor in network.state_dict().items()}
    digest = hashlib.sha256(json.dumps(shapes, sort_keys=True).encode()).hexdigest()
    numbers = sum(tensor.numel() for tensor in network.state_dict().values())
    return f"{type(network).__name__} of {numbers} numbers (shapes {digest[:12]})"


def described_data(parts: Mapping[Part, Encoded]) -> str:
    """What is trained and validated on, by its size and the digest of its inputs and labels."""
    digest = hashlib.sha256()
    used: tuple[Part, ...] = ("training", "validation")
    for part in used:
        data = parts[part]
        for values in (data.truth, data.is_hole, *(data.inputs[k] for k in sorted(data.inputs))):
            digest.update(f"{part} {values.shape} {values.dtype}".encode())
            digest.update(values.tobytes())
    sizes = " and ".join(f"{len(parts[part])} of {part}" for part in used)
    return f"{sizes} (SHA-256 {digest.hexdigest()[:12]})"
