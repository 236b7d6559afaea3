"""Aliases are welcome in files, as long as they stand for what a file may hold."""

from __future__ import annotations

from pathlib import Path

import pytest

from defras_bt.executive.tree_file import read_tree
from defras_sim.scene import load_scene
from defras_sim.yaml_aliases import MOST_ALIASED_NODES, alias_fault
from defras_sim.yaml_source import InvalidFile, read_yaml


def bomb(levels: int, width: int = 9) -> str:
    """Lists of aliases of lists: the last one stands for more than ``width ** levels`` values."""
    lines = ["name: bomb", f"x0: &x0 [{', '.join('a' * width)}]"]
    for level in range(1, levels):
        below = ", ".join([f"*x{level - 1}"] * width)
        lines.append(f"x{level}: &x{level} [{below}]")
    return "\n".join(lines) + "\n"


def values(data: object) -> int:
    """Values of plain data, expanded, keys among them."""
    if isinstance(data, dict):
        return 1 + sum(1 + values(value) for value in data.values())
    if isinstance(data, list):
        return 1 + sum(values(item) for item in data)
    return 1


@pytest.mark.parametrize("read", [read_yaml, read_tree, load_scene])
@pytest.mark.parametrize("levels", [9, 40])
def test_a_file_that_would_grow_without_end_is_refused_at_once(tmp_path: Path, read, levels):
    file = tmp_path / "bomb.yaml"
    file.write_text(bomb(levels) + f"tree: {{reactive: {{children: *x{levels - 1}}}}}\n")
    with pytest.raises(InvalidFile) as caught:
        read(file)
    (fault,) = caught.value.faults
    # Up to x3 aliases stand for 9 * 10 + 9 * 91 + 9 * 820 values; x4 would add 9 * 7381.
    assert (fault.file, fault.line) == (file, 6)
    assert f"at most {MOST_ALIASED_NODES} are valid" in fault.message


def test_what_is_counted_is_what_would_be_expanded(tmp_path: Path):
    """Expanded data, counted one by one, is as large as the limit says, and no value larger."""
    # x1 holds 90 values through aliases, and each *x1 stands for 91.
    copies = (MOST_ALIASED_NODES - 90) // 91
    file = tmp_path / "wide.yaml"
    file.write_text(bomb(2) + "wide:\n" + "  - *x1\n" * copies)
    aliased = 90 + values(read_yaml(file).data["wide"]) - 1
    assert MOST_ALIASED_NODES - 91 < aliased <= MOST_ALIASED_NODES
    fault = alias_fault(file.read_text() + "  - *x1\n")
    assert fault is not None
    # Four lines stand above the list.
    assert (fault.line, fault.column) == (4 + copies + 1, 5)
    assert f"stand for {aliased + 91} values" in fault.message


def test_an_alias_within_its_own_anchor_is_refused(tmp_path: Path):
    file = tmp_path / "round.yaml"
    file.write_text("name: round\nlist: &list\n  - 1\n  - [*list]\n")
    with pytest.raises(InvalidFile, match=r"round\.yaml:4:6: \*list stands within &list itself"):
        read_yaml(file)


def test_aliases_of_a_sensible_size_are_read(tmp_path: Path):
    file = tmp_path / "fine.yaml"
    file.write_text("one: &one {a: 1, b: [2, 3]}\ntwo: *one\nthree: {<<: *one, c: 4}\n")
    data = read_yaml(file).data
    assert data["two"] == data["one"] == {"a": 1, "b": [2, 3]}
    assert data["three"] == {"a": 1, "b": [2, 3], "c": 4}
