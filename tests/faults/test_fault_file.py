"""Fault files: every kind can be written, every mistake is told with its place."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from defras_bt.faults.faults import KINDS, Faults
from defras_bt.faults.file import SCHEMA_FILE, read_faults, schema_text
from defras_bt.faults.readings import Frozen
from defras_bt.faults.system import NodeRaises
from defras_sim.resources import resource
from defras_sim.yaml_source import InvalidFile

ARMS = ("psm1", "psm2")


def written(folder: Path, text: str) -> Path:
    file = folder / "faults.yaml"
    file.write_text(text, encoding="utf-8")
    return file


def test_a_file_is_read_with_everything_it_says(tmp_path: Path) -> None:
    text = """\
seed: 7
faults:
  - {fault: frozen, reading: cloud, start_s: 4.0, duration_s: 2.0}
  - fault: node_raises
    node: "**/act/*_pull_*"
"""
    assert read_faults(written(tmp_path, text), ARMS) == Faults(
        (
            Frozen(reading="cloud", start_s=4.0, duration_s=2.0),
            NodeRaises(node="**/act/*_pull_*"),
        ),
        7,
    )


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_can_be_written_and_says_what_it_is(tmp_path: Path, kind: str) -> None:
    read = read_faults(written(tmp_path, f"faults: [{{fault: {kind}}}]\n"), ARMS)
    assert type(read.faults[0]) is KINDS[kind]
    assert (KINDS[kind].__doc__ or "").strip().endswith(".")


@pytest.mark.parametrize("name", ["laboratory", "frozen_camera"])
def test_shipped_files_are_valid(name: str) -> None:
    assert read_faults(resource(f"sim/faults/{name}.yaml"), ARMS).faults


def test_the_schema_is_current() -> None:
    shipped = resource("sim/faults") / SCHEMA_FILE
    assert shipped.read_text(encoding="utf-8") == schema_text(), "print it anew: schema_text()"
    kinds = json.loads(schema_text())["properties"]["faults"]["items"]["oneOf"]
    assert [kind["properties"]["fault"]["const"] for kind in kinds] == list(KINDS)


@pytest.mark.parametrize(
    ("text", "place", "says"),
    [
        ("faults: []\n", ":1:1:", "list at least one"),
        ("seed: 1\n", ":1:1:", "list at least one"),
        ("faults: [freeze]\n", ":1:10:", "should be a mapping"),
        ("faults:\n  - {start_s: 1}\n", ":2:5:", "say which; there are: frozen"),
        ("faults:\n  - {fault: frozn}\n", ":2:6:", "did you mean frozen?"),
        ("faults:\n  - {fault: frozen, start: 1}\n", ":2:21:", "did you mean start_s?"),
        ("faults:\n  - {fault: frozen, start_s: -1}\n", ":2:21:", "greater than or equal to 0"),
        ("faults:\n  - {fault: frozen, duration_s: .nan}\n", ":2:21:", "finite"),
        ("faults:\n  - {fault: dropped, probability: 2}\n", ":2:22:", "less than or equal to 1"),
        ("faults:\n  - {fault: frozen, reading: nose}\n", ":2:21:", "'cloud'"),
        ("faults:\n  - {fault: jumped, arm: psm2}\n", ":2:21:", "the scene has no psm2"),
        ("faults:\n  - {fault: frozen, reading: psm2}\n", ":2:21:", "the scene has no psm2"),
        ("seed: -1\nfaults: [{fault: noisy}]\n", ":1:1:", "0, 1, 2"),
        ("sede: 1\nfaults: [{fault: noisy}]\n", ":1:1:", "did you mean seed?"),
    ],
)
def test_a_mistake_is_told_with_its_place(tmp_path: Path, text: str, place: str, says: str) -> None:
    file = written(tmp_path, text)
    with pytest.raises(InvalidFile) as caught:
        read_faults(file, ("psm1",))
    assert f"{file}{place}" in str(caught.value)
    assert says in str(caught.value)


def test_all_mistakes_at_once(tmp_path: Path) -> None:
    text = "seed: x\nfaults:\n  - {fault: frozn}\n  - {fault: sparse, points: 99, start: 1}\n"
    with pytest.raises(InvalidFile) as caught:
        read_faults(written(tmp_path, text), ARMS)
    assert [fault.line for fault in caught.value.faults] == [1, 3, 4, 4]
