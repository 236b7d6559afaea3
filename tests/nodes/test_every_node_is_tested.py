"""Each node that comes with this project has its own test file, tests/nodes/test_<name>.py."""

from pathlib import Path

import pytest

from defras_bt.executive.registry import builtin_nodes, snake_case

HERE = Path(__file__).parent


@pytest.mark.parametrize("node", sorted(builtin_nodes()))
def test_the_node_has_a_test_file(node):
    file = HERE / f"test_{snake_case(node)}.py"
    assert file.is_file(), f"{node} has no tests; write them in tests/nodes/{file.name}"
    assert node in file.read_text(encoding="utf-8"), f"{file.name} does not mention {node}"
