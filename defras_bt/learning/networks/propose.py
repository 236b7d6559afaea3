"""What trained networks say of the attachments: a probability for every hole, and how sure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import torch
from torch import Tensor

from defras_bt.learning.estimate import Keyframe
from defras_bt.learning.networks.banet import VoxelNetwork
from defras_bt.learning.networks.hole_features import hole_features
from defras_bt.learning.networks.sequence import SequenceNetwork
from defras_bt.learning.networks.voxels import corners_of_holes, voxel_inputs
from defras_bt.learning.networks.weights import Trained
from defras_bt.learning.prediction import Predicted
from defras_sim.geometry import Floats
from defras_sim.scene import Scene


@dataclass(frozen=True)
class Proposal:
    """``probability`` (holes,) that each hole holds, and ``uncertainty`` (holes,): the standard
    deviation between what the heads of the network say; 0 of a network with one head."""

    probability: Floats
    uncertainty: Floats


class Proposer(Protocol):
    """A network that proposes attachments."""

    @property
    def name(self) -> str: ...

    def propose(
        self, belief: Scene, keyframes: Sequence[Keyframe], predicted: Predicted
    ) -> Proposal | None:
        """``predicted`` is what the twin does at the keyframes under the belief. None where the
        camera sees nothing that could be compared."""


class SequenceProposer:
    """The sequence network."""

    name = "sequence"

    def __init__(self, trained: Trained) -> None:
        assert isinstance(trained.network, SequenceNetwork)
        self._network, self._temperature = trained.network, trained.temperature

    def propose(
        self, belief: Scene, keyframes: Sequence[Keyframe], predicted: Predicted
    ) -> Proposal | None:
        """See :class:`Proposer`."""
        found = hole_features(belief, keyframes, predicted)
        if found is None:
            return None
        rows, columns = found.grid
        frames = torch.from_numpy(found.frames).float().unflatten(1, (rows, columns))
        holes = torch.from_numpy(found.holes).float().unflatten(0, (rows, columns))
        with torch.inference_mode():
            logits: Tensor = self._network(
                frames.permute(0, 3, 1, 2)[None],
                holes.permute(2, 0, 1)[None],
                torch.ones(1, len(frames)),
            )
        return _said(logits[0].flatten(1), self._temperature, belief)


class VoxelProposer:
    """BANet: the tissue at rest and the newest cloud."""

    name = "banet"

    def __init__(self, trained: Trained) -> None:
        assert isinstance(trained.network, VoxelNetwork)
        self._network, self._temperature = trained.network, trained.temperature

    def propose(
        self, belief: Scene, keyframes: Sequence[Keyframe], predicted: Predicted
    ) -> Proposal | None:
        """See :class:`Proposer`; neither the belief nor the prediction is used."""
        cloud_m = keyframes[-1].cloud_m
        if len(cloud_m) == 0:
            return None
        corners, weights = corners_of_holes(belief)
        with torch.inference_mode():
            logits = self._network.at(
                torch.from_numpy(voxel_inputs(belief, cloud_m)).float()[None],
                torch.from_numpy(corners)[None],
                torch.from_numpy(weights).float()[None],
            )
        return _said(logits, self._temperature, belief)


def proposer(trained: Trained) -> SequenceProposer | VoxelProposer:
    """The proposer of a trained network of either kind."""
    if isinstance(trained.network, SequenceNetwork):
        return SequenceProposer(trained)
    return VoxelProposer(trained)


def _said(logits: Tensor, temperature: float, belief: Scene) -> Proposal:
    """From logits (heads, holes); where there is no tissue nothing holds, surely."""
    each = torch.sigmoid(logits / temperature).numpy().astype(float) * belief.is_hole
    return Proposal(np.asarray(each.mean(axis=0)), np.asarray(each.std(axis=0)))
