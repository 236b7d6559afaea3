"""All estimators of the attachments by name."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Literal

from defras_bt.learning.estimate import AttachmentEstimator
from defras_bt.learning.inverse import InverseEstimator
from defras_bt.learning.networks.own_weights import OwnWeights

EstimatorName = Literal["inverse", "banet", "sequence", "chain"]
ESTIMATORS: tuple[EstimatorName, ...] = ("inverse", "banet", "sequence", "chain")
NetworkName = Literal["banet", "sequence"]
NETWORK_OF: Mapping[EstimatorName, NetworkName | None] = {
    "inverse": None,
    "banet": "banet",
    "sequence": "sequence",
    "chain": "sequence",
}
"""Which network each estimator asks."""


@cache
def estimator(name: EstimatorName, own: OwnWeights | None = None) -> AttachmentEstimator:
    """The estimator called ``name``, with the shipped weights if it needs any, or with ``own``.

    torch is loaded only where a network is asked for.

    Raises:
        NoWeights: the weights of a network are missing, or not what their card says.
    """
    network = NETWORK_OF[name]
    if network is None:
        return InverseEstimator()
    from defras_bt.learning.chain.chain import ChainEstimator
    from defras_bt.learning.networks.estimator import NetworkEstimator
    from defras_bt.learning.networks.propose import proposer
    from defras_bt.learning.networks.weights import SHIPPED, read_weights

    folder = SHIPPED if own is None else own.folder
    asked = proposer(read_weights(network, folder))
    return ChainEstimator((asked,)) if name == "chain" else NetworkEstimator(asked)
