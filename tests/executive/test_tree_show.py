"""Trees as text."""

import pytest

from defras_bt.executive.node import NoParameters
from defras_bt.executive.tree_file import read_tree
from defras_bt.executive.tree_show import (
    outline_of_spec,
    outline_of_tree,
    show_mermaid,
    show_text,
)
from tests.executive.port_toys import port_registry
from tests.executive.test_tree_ports import HOLD

TREE = """
reactive_selector:
  children:
    - reactive:
        name: operate
        children:
          - Limit: {name: force, limit_n: 0.3}
          - retry: {attempts: 2, child: Mend}
          - plan_slot: {name: act}
    - Think
"""


@pytest.fixture
def tree(load_toys):
    return load_toys(TREE)


def test_a_file_is_shown_without_anything_to_run_it(tree, tmp_path, toys):
    spec = read_tree(tmp_path / "tree.yaml", toys.registry).root
    assert show_text(outline_of_spec(spec)).splitlines() == [
        "⁇ toy (reactive_selector)",
        "├─ ⇉ operate (reactive)",
        "│  ├─ ◆ force (Limit) limit_n=0.3",
        "│  ├─ ◇ retry attempts=2",
        "│  │  └─ ↻ mend",
        "│  └─ ▤ act (plan_slot)",
        "└─ • think",
    ]


def test_ports_are_shown_with_their_keys(write_tree):
    write_tree(HOLD, "hold.yaml")
    text = """
name: toy
tree:
  sequence:
    children:
      - Measure
      - subtree: {file: hold.yaml, ports: {wanted_n: tension_n}}
      - subtree: {file: hold.yaml, name: strong, ports: {wanted_n: 2}}
"""
    spec = read_tree(write_tree(text), port_registry()).root
    assert show_text(outline_of_spec(spec)).splitlines() == [
        "→ toy (sequence)",
        "├─ • measure",
        "├─ ⇉ hold (reactive)",
        "│  └─ • hold wanted_n@tension_n",
        "└─ ⇉ strong (reactive)",
        "   └─ • hold wanted_n@toy/strong/wanted_n",
    ]


def test_a_running_tree_is_shown_with_its_plan_and_what_was_said(tree, toys, toy_context):
    tree.plan_slot.fill([toys.Push("1_pull", toy_context, NoParameters())])
    statuses = {
        "toy": "RUNNING",
        "toy/operate": "RUNNING",
        "toy/operate/force": "SUCCESS",
        "toy/operate/retry": "FAILURE",
        "toy/think": "",
    }
    messages = {"toy/operate/force": "0.12 N", "toy/think": ""}
    assert show_text(outline_of_tree(tree.root), statuses, messages).splitlines() == [
        "… ⁇ toy (reactive_selector)",
        "├─ … ⇉ operate (reactive)",
        "│  ├─ ✓ ◆ force (Limit) limit_n=0.3: 0.12 N",
        "│  ├─ ✗ ◇ retry",
        "│  │  └─ · ↻ mend",
        "│  └─ · ▤ act (plan_slot)",
        "│     └─ · ▶ 1_pull (Push)",
        "└─ · • think",
    ]


def test_mermaid_has_a_shape_for_each_node_and_an_edge_to_its_parent(tree):
    lines = show_mermaid(outline_of_tree(tree.root)).splitlines()
    assert lines[0] == "flowchart TD"
    shapes = [line.split('"')[1] for line in lines if '"' in line]
    edges = [line.split() for line in lines if "-->" in line]
    assert len(shapes) == len(edges) + 1 == len(tree.paths())
    assert any('{{"◆ force (Limit) limit_n=0.3"}}' in line for line in lines)
    assert len({child for _, _, child in edges}) == len(edges)
