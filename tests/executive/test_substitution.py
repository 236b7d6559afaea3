"""Files that replace nodes by scripted leaves: what they may say, and what becomes of the tree."""

from __future__ import annotations

import json

import pytest
from py_trees.common import Status

from defras_bt.acting.actions import action_leaves
from defras_bt.executive.loader import build_tree
from defras_bt.executive.node import NoParameters
from defras_bt.executive.scripted import ScriptedLeaf
from defras_bt.executive.substitution import Substitutes, read_substitutes, substitutes_schema
from defras_bt.executive.testing import NodeBench, plan_of
from defras_bt.executive.tree_file import read_tree
from defras_sim.resources import resource
from defras_sim.yaml_source import InvalidFile
from tests.executive.stage import Stage, doing, jaws, still

TREE = """
reactive:
  children:
    - Watch: {name: force}
    - invert: {name: unless, child: {Watch: {name: stopped}}}
    - selector:
        name: doing
        children:
          - reactive: {name: careful, children: [{Watch: {name: near}}, {plan_slot: {name: act}}]}
          - Mend
"""


@pytest.fixture
def substitutes(tmp_path):
    """``substitutes(text)`` reads a file with these entries."""

    def read(entries: str) -> Substitutes:
        file = tmp_path / "mocks.yaml"
        file.write_text(f"substitutes:\n{entries}", encoding="utf-8")
        return read_substitutes(file)

    return read


@pytest.fixture
def spec(write_tree, toys):
    indented = "\n".join(f"  {line}" for line in TREE.strip().splitlines())
    return read_tree(write_tree(f"name: toy\ntree:\n{indented}\n"), toys.registry)


def faults(read) -> list[str]:
    with pytest.raises(InvalidFile) as caught:
        read()
    return [str(fault).partition("mocks.yaml:")[2] for fault in caught.value.faults]


class TestTrees:
    def test_leaves_children_of_decorators_and_branches_are_replaced(
        self, substitutes, load_toys, toy_context, spec
    ):
        told = substitutes(
            "  - {path: '*/force', status: FAILURE}\n"
            "  - {path: '**/stopped', status: RUNNING}\n"
            "  - {path: toy/doing/mend, status: SUCCESS}\n"
        )
        assert told.paths(spec) == ("toy/force", "toy/unless/stopped", "toy/doing/mend")
        tree = load_toys(TREE)
        slot = tree.plan_slot
        tree = told.into_tree(tree, toy_context)
        kinds = dict(tree.kinds())
        assert [path for path, kind in kinds.items() if kind == "ScriptedLeaf"] == [
            "toy/force",
            "toy/unless/stopped",
            "toy/doing/mend",
        ]
        assert list(kinds) == [path for path, _ in spec.root.walk()], "names and order stay"
        assert tree.plan_slot is slot
        for behaviour in tree.root.iterate():
            assert all(child.parent is behaviour for child in behaviour.children)

    def test_a_guard_that_fails_by_script_stops_what_it_guards(
        self, substitutes, load_toys, toys, toy_context
    ):
        told = substitutes(
            "  - path: '**/near'\n"
            "    steps: [{status: SUCCESS, ticks: 2}, {status: FAILURE, message: Too near.}]\n"
            "  - {path: '**/stopped', status: FAILURE}\n"
        )
        tree = told.into_tree(load_toys(TREE), toy_context)
        push = toys.Push("1_push", toy_context, NoParameters())
        tree.plan_slot.fill([push])
        seen = []
        for _ in range(3):
            tree.root.tick_once()
            seen.append(push.status)
        assert seen == [Status.RUNNING, Status.RUNNING, Status.INVALID]

    def test_the_first_entry_that_speaks_of_a_node_counts(
        self, substitutes, load_toys, toy_context
    ):
        told = substitutes(
            "  - {path: toy/force, status: FAILURE}\n  - {path: 'toy/*o*e', status: SUCCESS}\n"
        )
        tree = told.into_tree(load_toys(TREE), toy_context)
        tree.root.tick_once()
        assert tree.root.children[0].status == Status.FAILURE

    def test_without_entries_everything_stays(self, load_toys, toy_context):
        tree = load_toys(TREE)
        assert Substitutes().into_tree(tree, toy_context) is tree

    def test_a_whole_tree_may_be_one_script(self, substitutes, load_toys, toy_context):
        told = substitutes("  - {path: toy, status: RUNNING, after_s: 0}\n")
        (entry, _), *_ = told.entries
        assert entry.path == "toy"
        tree = load_toys("Think")
        assert isinstance(told.into_tree(tree, toy_context).root, ScriptedLeaf)


class TestPlans:
    def test_actions_of_every_coming_plan_are_replaced(self, substitutes):
        bench = NodeBench()
        tree = read_tree(resource("trees/fras.yaml"))
        told = substitutes("  - {path: '**/act/*_pull_*', status: SUCCESS, after_s: 1}\n")
        (pattern,) = told.paths(tree)
        assert pattern == "**/act/*_pull_*"
        loaded = build_tree(tree, bench.context)
        leaves = action_leaves(plan_of((2, 4)), bench.context)
        put = told.into_plan(loaded.plan_slot, loaded.root, leaves, bench.context)
        assert [type(leaf) is ScriptedLeaf for leaf in put] == [True, False, False]
        assert [leaf.name for leaf in put] == [leaf.name for leaf in leaves]
        assert put[1:] == leaves[1:]


class TestRuns:
    def test_a_substituted_motion_moves_nothing_and_everybody_is_told(self, substitutes):
        told = substitutes("  - {path: '**/act/*_pull_*', status: SUCCESS, after_s: 0.5}\n")
        stage = Stage("fras", substitutes=told)
        stage.until("the grasp is done", lambda r: doing(r) == "pull")
        pulling = stage.ticks(0.4)
        assert {doing(record) for record in pulling} == {"pull"}
        assert all(still(record) and not jaws(record) for record in pulling)
        stage.until_doing("fold")
        assert stage.notes.records[0].events[0].level == "warning"
        (sentence,) = stage.notes.told("start")[:1]
        assert "This is a trial" in sentence
        assert "**/act/*_pull_*" in sentence
        assert stage.executive.substituted == ("**/act/*_pull_*",)

    def test_a_guard_that_always_succeeds_does_not_fool_the_gate(self, substitutes):
        told = substitutes(
            "  - {path: '**/force_accepted', status: SUCCESS}\n"
            "  - {path: '**/sensors_fresh', status: SUCCESS}\n"
        )
        stage = Stage("fras", substitutes=told)
        stage.until_doing("pull")
        stage.bench.twin.feels_n = float("nan")
        blind = stage.ticks(0.3)
        assert doing(blind[-1]) == "pull", "the tree goes on"
        assert all(still(record) for record in blind), "the gate does not"

    def test_without_substitutes_nothing_is_told(self):
        stage = Stage("fras")
        stage.tick()
        assert not any("trial" in sentence for sentence in stage.notes.told("start"))


class TestFaults:
    def test_all_faults_of_the_format_at_their_places(self, substitutes):
        found = faults(
            lambda: substitutes(
                "  - {path: a, status: SUCESS}\n"
                "  - {path: b, statsu: SUCCESS}\n"
                "  - {status: SUCCESS}\n"
            )
        )
        assert {fault.split(":")[0] for fault in found} == {"2", "3", "4"}
        assert any("did you mean status" in fault for fault in found)

    def test_a_path_that_is_not_there(self, substitutes, spec):
        told = substitutes("  - {path: toy/unless/stoped, status: SUCCESS}\n")
        (fault,) = faults(lambda: told.paths(spec))
        assert fault.startswith(
            "2:6: no node has the path 'toy/unless/stoped'; did you mean toy/unless/stopped"
        )

    @pytest.mark.parametrize("path", ["toy", "toy/doing", "toy/*/careful", "**/act", "**"])
    def test_the_place_for_plans_has_to_stay(self, substitutes, spec, path):
        told = substitutes(f"  - {{path: '{path}', status: SUCCESS}}\n")
        (fault,) = faults(lambda: told.paths(spec))
        assert "where plans are carried out" in fault
        assert "'toy/doing/careful/act/*_pull_*'" in fault

    def test_an_entry_that_replaces_nothing_more(self, substitutes, spec):
        told = substitutes(
            "  - {path: '**/mend', status: SUCCESS}\n"
            "  - {path: toy/unless, status: SUCCESS}\n"
            "  - {path: toy/unless/stopped, status: SUCCESS}\n"
            "  - {path: 'toy/doing/m*', status: SUCCESS}\n"
        )
        assert faults(lambda: told.paths(spec)) == [
            "4:6: 'toy/unless/stopped' replaces nothing that line 3 does not",
            "5:6: 'toy/doing/m*' replaces nothing that line 2 does not",
        ]

    def test_an_empty_file(self, substitutes):
        (fault,) = faults(lambda: substitutes("  []\n"))
        assert "at least one node" in fault


def test_editors_get_the_schema():
    file = resource("trees/substitutes.schema.json")
    assert json.loads(file.read_text(encoding="utf-8")) == substitutes_schema()
