"""What ``defras train`` refuses: exit code 2, with what would be valid."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

Defras = Callable[..., tuple[int, str, str]]


@pytest.mark.parametrize("network", ["banet", "sequence"])
def test_a_width_that_no_network_has(defras: Defras, tmp_path: Path, network: str) -> None:
    code, _, err = defras("train", network, "--data", str(tmp_path), "--width", "9")
    assert code == 2
    assert "--width: width 9: valid are multiples of 8" in err


@pytest.mark.parametrize("content", ["junk", "[]", '{"format": "other"}'])
def test_a_broken_manifest(defras: Defras, tmp_path: Path, content: str) -> None:
    (tmp_path / "manifest.json").write_text(content)
    for command in (["data", "--out", str(tmp_path)], ["banet", "--data", str(tmp_path)]):
        out = ["--out", str(tmp_path / "o")] if command[0] == "banet" else []
        code, _, err = defras("train", *command, *out)
        assert code == 2
        assert "manifest.json" in err


def test_an_empty_shard(defras: Defras, tmp_path: Path) -> None:
    request = '{"format": "defras attachment data 1", "request": {"seed": 0, "samples": 9}}'
    (tmp_path / "manifest.json").write_text(request)
    (tmp_path / "shards").mkdir()
    (tmp_path / "shards" / "00000.npz").touch()
    code, _, err = defras("train", "banet", "--data", str(tmp_path), "--out", str(tmp_path / "o"))
    assert code == 2
    assert "00000.npz cannot be read as a shard" in err


def test_a_run_with_weights_that_are_not_there(defras: Defras, tmp_path: Path) -> None:
    code, _, err = defras("run", "demo", "--weights", str(tmp_path))
    assert code == 2
    assert f"{tmp_path} holds no weights" in err


@pytest.mark.parametrize(
    ("tree", "said"), [("fras", "asks no network"), ("defras", "asks sequence")]
)
def test_a_run_with_weights_that_its_tree_does_not_ask(
    defras: Defras, tmp_path: Path, tree: str, said: str
) -> None:
    (tmp_path / "banet.json").write_text("{}")
    code, _, err = defras("run", "demo", "--tree", tree, "--weights", str(tmp_path))
    assert code == 2
    assert "weights of banet" in err
    assert f"the tree {tree} {said}" in err
