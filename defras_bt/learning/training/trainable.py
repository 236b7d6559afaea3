"""What the training loop needs of either network: a batch in, logits of the holes out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from defras_bt.learning.networks.banet import VoxelNetwork
from defras_bt.learning.networks.sequence import HEADS, SequenceNetwork
from defras_bt.learning.networks.symmetry import mirrored
from defras_bt.learning.networks.weights import NetworkName, built
from defras_bt.learning.training.encoding import SIDE, Encoded

Inputs = Mapping[str, Tensor]


class Trainable(Protocol):
    """A network with the way in which batches go through it. Labels and logits are (b, 256)."""

    @property
    def network(self) -> nn.Module: ...

    @property
    def heads(self) -> int: ...

    def logits(self, inputs: Inputs) -> Tensor:
        """Logits (b, heads, 256)."""

    def varied(
        self, inputs: Inputs, labels: Tensor, rng: np.random.Generator
    ) -> tuple[Inputs, Tensor]:
        """The batch as another one that might have been seen as well. ``labels`` (b, k, 256)."""


class TrainableSequence:
    """The sequence network; batches are mirrored and turned, and frames are left out."""

    def __init__(self, network: SequenceNetwork) -> None:
        self.network: SequenceNetwork = network
        self.heads = HEADS

    def logits(self, inputs: Inputs) -> Tensor:
        logits: Tensor = self.network(inputs["frames"], inputs["holes"], inputs["known"])
        return logits.flatten(2)

    def varied(
        self, inputs: Inputs, labels: Tensor, rng: np.random.Generator
    ) -> tuple[Inputs, Tensor]:
        x, y, swap = (bool(choice) for choice in rng.random(3) < 0.5)
        grid = labels.unflatten(-1, (SIDE, SIDE))
        frames, holes, grid = mirrored(inputs["frames"], inputs["holes"], grid, x=x, y=y, swap=swap)
        # Any but the newest may be missing.
        dropped = torch.from_numpy(rng.random(tuple(inputs["known"].shape)) < 0.15)
        dropped[:, -1] = False
        known = inputs["known"] * ~dropped.to(inputs["known"].device)
        return {"frames": frames, "holes": holes, "known": known}, grid.flatten(-2)


class TrainableVoxels:
    """The voxel network; batches are mirrored and turned about the vertical."""

    def __init__(self, network: VoxelNetwork) -> None:
        self.network: VoxelNetwork = network
        self.heads = 1

    def logits(self, inputs: Inputs) -> Tensor:
        return self.network.at(inputs["channels"], inputs["corners"], inputs["weights"])[:, None]

    def varied(
        self, inputs: Inputs, labels: Tensor, rng: np.random.Generator
    ) -> tuple[Inputs, Tensor]:
        channels, corners = inputs["channels"], inputs["corners"]
        x, y, z = channels.shape[2:]
        place = torch.stack([corners // (y * z), corners // z % y, corners % z])
        for axis in (0, 1):
            if rng.random() < 0.5:
                channels = channels.flip(2 + axis)
                place[axis] = (x, y)[axis] - 1 - place[axis]
        if rng.random() < 0.5:
            channels, place = channels.transpose(2, 3), place[[1, 0, 2]]
        corners = (place[0] * y + place[1]) * z + place[2]
        return {**inputs, "channels": channels, "corners": corners}, labels


def trainable(network: NetworkName, config: Mapping[str, Any]) -> Trainable:
    """An untrained network of a kind; ``config`` are arguments of its class."""
    made = built(network, config)
    return TrainableSequence(made) if isinstance(made, SequenceNetwork) else TrainableVoxels(made)


def device_of(model: Trainable) -> torch.device:
    """Where the network of ``model`` computes."""
    return next(model.network.parameters()).device


def batch(data: Encoded, rows: NDArray[np.int64], device: torch.device) -> Inputs:
    """The inputs of some samples as tensors on ``device``; numbers as float32."""
    tensors = {name: torch.from_numpy(values[rows]) for name, values in data.inputs.items()}
    return {
        name: (tensor.long() if tensor.dtype == torch.int32 else tensor.float()).to(device)
        for name, tensor in tensors.items()
    }
