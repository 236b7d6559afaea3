"""Weights of one's own in place of the shipped ones; knows them by their cards, without torch."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from defras_bt.learning.networks.no_weights import NoWeights

NAMES = ("banet", "sequence")


@dataclass(frozen=True)
class OwnWeights:
    """A folder that ``defras train`` wrote to, and which cards are in it.

    ``cards``: by network the SHA-256 of NAME.json, which in turn says that of NAME.safetensors.
    """

    folder: Path
    cards: tuple[tuple[str, str], ...]

    @staticmethod
    def of(folder: Path) -> OwnWeights:
        """The weights in ``folder``.

        Raises:
            NoWeights: there is no card of any network.
        """
        files = [(name, folder / f"{name}.json") for name in NAMES]
        cards = tuple(
            (name, hashlib.sha256(file.read_bytes()).hexdigest())
            for name, file in files
            if file.is_file()
        )
        if not cards:
            raise NoWeights(
                f"{folder} holds no weights: neither banet.json nor sequence.json is there; train "
                f"some: defras train sequence --data DIR --out {folder}"
            )
        return OwnWeights(folder.resolve(), cards)

    def values(self) -> Mapping[str, Any]:
        """Plain values, for the record of a run; back with :meth:`recorded`."""
        return {"folder": str(self.folder), "cards": dict(self.cards)}

    @staticmethod
    def recorded(values: Mapping[str, Any]) -> OwnWeights:
        """The weights that a run was recorded with.

        Raises:
            NoWeights: they are not there any more, or others are.
        """
        own = OwnWeights.of(Path(values["folder"]))
        if dict(own.cards) != values["cards"]:
            raise NoWeights(
                f"{own.folder} holds other weights than when this was recorded; put back those "
                "whose cards have these SHA-256: "
                + ", ".join(f"{name} {digest[:12]}" for name, digest in values["cards"].items())
            )
        return own
