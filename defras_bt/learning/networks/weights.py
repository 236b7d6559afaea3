"""Weights of networks: a safetensors file, and a model card (JSON) that says all about it.

safetensors holds numbers only, so that reading weights runs nobody's code. The card names the
SHA-256 of the file, and weights that do not have it are not used.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from safetensors.torch import load, save
from torch import Tensor, nn

from defras_bt.learning.networks.banet import VoxelNetwork
from defras_bt.learning.networks.no_weights import NoWeights
from defras_bt.learning.networks.sequence import SequenceNetwork

NetworkName = Literal["banet", "sequence"]
NETWORKS: tuple[NetworkName, ...] = ("banet", "sequence")

SHIPPED = Path(__file__).parent.parent / "weights"
"""The weights that come with the project."""

FORMAT = "defras attachment network 1"

WIDTH_STEP = 8


@dataclass(frozen=True)
class Trained:
    """A network, the temperature by which its logits are to be divided, and its card."""

    network: nn.Module
    temperature: float
    card: Mapping[str, Any]


def built(name: NetworkName, config: Mapping[str, Any]) -> VoxelNetwork | SequenceNetwork:
    """An untrained network; ``config`` are arguments of its class.

    Raises:
        ValueError: its width is not a multiple of :data:`WIDTH_STEP`, which its groups and heads
            are made for.
    """
    width = config.get("width", WIDTH_STEP)
    if width < WIDTH_STEP or width % WIDTH_STEP:
        raise ValueError(f"width {width}: valid are multiples of {WIDTH_STEP}")
    return SequenceNetwork(**config) if name == "sequence" else VoxelNetwork(**config)


def write_weights(
    folder: Path, name: NetworkName, tensors: Mapping[str, Tensor], card: Mapping[str, Any]
) -> Path:
    """Write NAME.safetensors and NAME.json; the card is completed by format, name and hash.

    ``card`` has to have ``config`` (arguments of the network) and ``temperature``.
    """
    folder.mkdir(parents=True, exist_ok=True)
    content = save({key: value.contiguous() for key, value in tensors.items()})
    file = folder / f"{name}.safetensors"
    file.write_bytes(content)
    said = {
        "format": FORMAT,
        "network": name,
        "sha256": hashlib.sha256(content).hexdigest(),
        "parameters": sum(value.numel() for value in tensors.values()),
        **card,
    }
    (folder / f"{name}.json").write_text(json.dumps(said, indent=2) + "\n", encoding="utf-8")
    return file


def read_weights(name: NetworkName, folder: Path = SHIPPED) -> Trained:
    """The trained network called ``name``.

    Raises:
        NoWeights: they are missing, of another format, or not the ones that the card describes.
    """
    file, card_file = folder / f"{name}.safetensors", folder / f"{name}.json"
    for each in (file, card_file):
        if not each.is_file():
            raise NoWeights(
                f"the weights of the network {name!r} are not here: {each} is missing; install "
                f"defras again, or train them: defras train {name} --data DIR"
            )
    card = json.loads(card_file.read_text(encoding="utf-8"))
    if card.get("format") != FORMAT or card.get("network") != name:
        raise NoWeights(
            f"{card_file} is no card of the network {name!r} in the format {FORMAT!r}: it says "
            f"{card.get('network')!r} in {card.get('format')!r}"
        )
    content = file.read_bytes()
    digest = hashlib.sha256(content).hexdigest()
    if digest != card["sha256"]:
        raise NoWeights(
            f"{file} is not what its card describes: its SHA-256 begins with {digest[:12]}, not "
            f"with {card['sha256'][:12]}; install defras again, or train it: defras train {name}"
        )
    network = built(name, card["config"])
    network.load_state_dict(load(content))
    network.eval()
    return Trained(network, float(card["temperature"]), card)
