"""Data that is missing, cut or something else is named with its file before any training."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from defras_bt.learning.data.generate import Request, open_manifest, read_manifest
from defras_bt.learning.data.shards import FORMAT, InvalidData, read_shard
from defras_bt.learning.training.loop import Settings
from defras_bt.learning.training.run import train_network


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "manifest.json cannot be read as JSON"),
        (b"\xff junk", "manifest.json cannot be read as JSON"),
        (b"[]", "has the format None"),
        (b'{"format": "other"}', "has the format 'other'"),
        (json.dumps({"format": FORMAT}).encode(), "whole numbers seed and samples, not None"),
        (
            json.dumps({"format": FORMAT, "request": {"seed": "1"}}).encode(),
            "whole numbers seed and samples",
        ),
    ],
)
def test_a_broken_manifest_is_named(tmp_path: Path, content: bytes, says: str) -> None:
    (tmp_path / "manifest.json").write_bytes(content)
    with pytest.raises(InvalidData, match=says):
        open_manifest(tmp_path, Request(0, 100))
    assert (tmp_path / "manifest.json").read_bytes() == content


def test_a_manifest_is_read_back(tmp_path: Path) -> None:
    open_manifest(tmp_path, Request(3, 100))
    assert read_manifest(tmp_path) == Request(3, 100)


def test_without_a_manifest_nothing_is_trained(tmp_path: Path) -> None:
    out = tmp_path / "out"
    told: list[str] = []
    with pytest.raises(InvalidData, match=r"manifest\.json is missing"):
        train_network(
            "banet", {}, tmp_path, out, Settings(), threads=1, resume=False, tell=told.append
        )
    assert told == []
    assert not out.exists()


def _without_meta(file: Path) -> None:
    np.savez(file, x=np.zeros(3))


def _with_junk_meta(file: Path) -> None:
    np.savez(file, meta=np.frombuffer(b"{nonsense", np.uint8))


def _of_nothing_else(file: Path) -> None:
    meta = json.dumps({"format": FORMAT, "tissue": {}, "patients": []}).encode()
    np.savez(file, meta=np.frombuffer(meta, np.uint8))


def _pickled(file: Path) -> None:
    np.savez(file, meta=np.array([{"format": FORMAT}], dtype=object))


def _one_array(file: Path) -> None:
    with file.open("wb") as stream:
        np.save(stream, np.zeros(3))


def _cut(file: Path) -> None:
    np.savez_compressed(file, meta=np.arange(1000, dtype=np.uint8))
    file.write_bytes(file.read_bytes()[:200])


@pytest.mark.parametrize(
    "write",
    [
        lambda file: file.write_bytes(b""),
        lambda file: file.write_bytes(b"junk"),
        _without_meta,
        _with_junk_meta,
        _of_nothing_else,
        _pickled,
        _one_array,
        _cut,
    ],
)
def test_a_broken_shard_is_named(tmp_path: Path, write: Callable[[Path], object]) -> None:
    file = tmp_path / "shards" / "00000.npz"
    file.parent.mkdir()
    write(file)
    with pytest.raises(InvalidData, match=r"00000\.npz"):
        read_shard(file)
