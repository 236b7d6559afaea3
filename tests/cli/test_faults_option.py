"""``defras run --faults`` and ``defras benchmark faults``: what they take and what they say."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.test_interrupted_runs import QUICK

Defras = Callable[..., tuple[int, str, str]]


@pytest.fixture
def scene(tmp_path: Path) -> str:
    file = tmp_path / "quick.yaml"
    file.write_text(QUICK.format(rows=", ".join(['"........####"'] * 12)), encoding="utf-8")
    return str(file)


def test_injected_faults_are_announced_and_stop_the_arms(
    defras: Defras, scene: str, tmp_path: Path
) -> None:
    faults = tmp_path / "faults.yaml"
    faults.write_text("faults:\n  - {fault: frozen, reading: camera, start_s: 0.3}\n")
    code, out, _ = defras("run", scene, "--tree", "fras", "--faults", str(faults))
    assert code == 4
    assert "A TRIAL, NOT AN OPERATION: faults are injected (frozen)." in out
    assert "a human is asked" in out
    assert "cloud is" in out


def test_a_mistake_in_the_file_is_told_before_anything_runs(
    defras: Defras, scene: str, tmp_path: Path
) -> None:
    faults = tmp_path / "faults.yaml"
    faults.write_text("faults:\n  - {fault: frozn}\n")
    code, _, err = defras("run", scene, "--faults", str(faults))
    assert code == 2
    assert f"{faults}:2:6:" in err
    assert "did you mean frozen?" in err


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("run", "demo", "--faults", "nothing"), "laboratory"),
        (("benchmark", "faults", "--kinds", "frozn"), "frozen"),
        (("benchmark", "faults", "--tree", "oak"), "defras_paper"),
    ],
)
def test_words_off(defras: Defras, arguments: tuple[str, ...], says: str) -> None:
    code, _, err = defras(*arguments)
    assert code == 2
    assert says in err
