"""Loaded trees: classes, parameters, names and paths, also after a plan was put in."""

from pathlib import Path

import pytest
from py_trees.common import Status

from defras_bt.executive.loader import load_tree
from defras_bt.executive.node import NoParameters
from defras_bt.executive.registry import NODES
from defras_bt.executive.tree_file import read_tree
from defras_sim.resources import resource
from defras_sim.yaml_source import InvalidFile

TREE = """
reactive_selector:
  children:
    - reactive:
        name: operate
        children:
          - Limit: {name: force, limit_n: 0.3}
          - plan_slot: {name: act}
    - Mend
"""


def test_leaves_get_context_and_parameters(load_toys, toy_context, toys):
    force = load_toys(TREE).root.children[0].children[0]
    assert type(force) is toys.Limit
    assert force.context is toy_context
    assert force.parameters == toys.Limit.Parameters(limit_n=0.3, patience_s=0.5)


def test_paths_join_the_names_from_the_root(load_toys):
    tree = load_toys(TREE)
    by_path = {path: behaviour for behaviour, path in tree.paths().items()}
    assert list(by_path) == [
        "toy",
        "toy/operate",
        "toy/operate/force",
        "toy/operate/act",
        "toy/mend",
    ]
    assert by_path["toy/operate/act"] == tree.plan_slot.id
    assert tree.kinds()[:3] == (
        ("toy", "reactive_selector"),
        ("toy/operate", "reactive"),
        ("toy/operate/force", "Limit"),
    )


def test_paths_follow_the_plan(load_toys, toys, toy_context):
    tree = load_toys(TREE)
    before = tree.paths()
    pull = toys.Push("1_pull", toy_context, NoParameters())
    tree.plan_slot.fill([pull])
    assert tree.paths()[pull.id] == "toy/operate/act/1_pull"
    assert ("toy/operate/act/1_pull", "Push") in tree.kinds()
    tree.plan_slot.clear()
    assert tree.paths() == before


def test_a_tree_without_a_slot(load_toys):
    tree = load_toys("Think")
    assert tree.plan_slot is None
    tree.root.tick_once()
    assert tree.root.status == Status.SUCCESS


def test_two_loads_share_nothing(write_tree, toy_context, toys):
    file = write_tree("name: twice\ntree: {sequence: {children: [Think]}}")
    first, second = (load_tree(file, toy_context, toys.registry) for _ in range(2))
    assert not set(first.paths()) & set(second.paths())


def test_an_invalid_file_makes_nothing(write_tree, toy_context, toys):
    file = write_tree("name: wrong\ntree: {sequence: {children: [Thing]}}")
    with pytest.raises(InvalidFile, match="did you mean Think"):
        load_tree(file, toy_context, toys.registry)


@pytest.mark.parametrize(
    "file", sorted(path.name for path in resource("trees").glob("*.yaml")), ids=str
)
def test_the_trees_that_come_with_this_project_are_valid(file: str):
    path: Path = resource("trees") / file
    assert read_tree(path, NODES).name == path.stem


@pytest.mark.parametrize(("line", "metric"), [("", None), ("metric: median", "median")])
def test_the_metric_that_counts_is_that_of_the_file(write_tree, toy_context, toys, line, metric):
    file = write_tree(f"name: toy\n{line}\ntree: Think\n")
    assert load_tree(file, toy_context, toys.registry).metric == metric
