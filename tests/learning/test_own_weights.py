"""Weights of one's own are found, used in place of the shipped ones, and known again."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from defras_bt.executive.again import recorded_weights
from defras_bt.learning.chain.estimators import estimator
from defras_bt.learning.networks.estimator import NetworkEstimator
from defras_bt.learning.networks.no_weights import NoWeights
from defras_bt.learning.networks.own_weights import OwnWeights
from defras_bt.learning.networks.propose import SequenceProposer
from defras_bt.learning.networks.weights import built, write_weights


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """An untrained network of eight channels, whose temperature no shipped one has."""
    torch.manual_seed(0)
    config = {"form": "grid", "width": 8}
    tensors = built("sequence", config).state_dict()
    write_weights(tmp_path, "sequence", tensors, {"config": config, "temperature": 7.5})
    return tmp_path


def test_the_estimator_uses_them(folder: Path) -> None:
    own, shipped = estimator("sequence", OwnWeights.of(folder)), estimator("sequence")
    assert isinstance(own, NetworkEstimator)
    assert isinstance(shipped, NetworkEstimator)
    assert isinstance(own.proposer, SequenceProposer)
    assert isinstance(shipped.proposer, SequenceProposer)
    assert own.proposer._temperature == 7.5
    assert shipped.proposer._temperature != 7.5


def test_a_network_that_is_not_among_them_is_not_taken_from_elsewhere(folder: Path) -> None:
    with pytest.raises(NoWeights, match=r"banet\.safetensors is missing"):
        estimator("banet", OwnWeights.of(folder))


def test_a_folder_without_weights_is_refused(tmp_path: Path) -> None:
    with pytest.raises(NoWeights, match="holds no weights: neither"):
        OwnWeights.of(tmp_path / "nowhere")


def test_a_recording_knows_them_again(folder: Path) -> None:
    own = OwnWeights.of(folder)
    again = {"weights": own.values()}
    assert recorded_weights(again) == own
    assert recorded_weights({}) is None
    card = folder / "sequence.json"
    card.write_text(card.read_text().replace("7.5", "1.5"))
    with pytest.raises(NoWeights, match="other weights than when this was recorded"):
        recorded_weights(again)
