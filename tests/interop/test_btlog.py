"""Logs for Groot2, read back by their published layout."""

from __future__ import annotations

from pathlib import Path
from xml.dom import minidom

import pytest

from defras_bt.executive.again import tree_files
from defras_bt.executive.registry import registered_nodes
from defras_bt.executive.testing import NodeBench
from defras_bt.interop.btlog import btlog_of_run
from defras_bt.recording.bag import BagRecorder
from defras_bt.recording.decision_reader import read_decisions
from defras_bt.recording.decisions import DECISIONS_FILE, DecisionRecorder
from defras_bt.recording.inputs_reader import BAG
from defras_bt.recording.record import RunInfo, RunSummary
from defras_sim.resources import resource
from tests.executive.stage import Stage
from tests.interop.btlog_reader import BtLog, read_btlog

IDLE, RUNNING, SUCCESS, FAILURE = range(4)
NAMES = {"RUNNING": RUNNING, "SUCCESS": SUCCESS, "FAILURE": FAILURE}


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    """A plan is begun, broken off by a slipped grasp, and made anew."""
    folder = tmp_path_factory.mktemp("run")
    recorders = [BagRecorder(folder / BAG), DecisionRecorder(folder / DECISIONS_FILE)]
    stage = Stage("fras", NodeBench(), beside=recorders)
    scene = stage.bench.scene
    info = RunInfo(
        scene=scene,
        scene_file="bench.yaml",
        actual=None,
        actual_file=None,
        world="bench",
        tree="fras",
        seed=0,
        metric=None,
        force_threshold_n=0.3,
        tree_paths=stage.executive.tree.kinds(),
        versions={},
        believed=scene.attached,
        again={"tree": tree_files(resource("trees/fras.yaml"))},
    )
    stage.recorder.start(info)
    stage.until_doing("pull")
    stage.ticks(0.3)
    stage.bench.world.tools["psm1"].grasped = False
    stage.until_doing("reach")
    stage.ticks(0.5)
    stage.recorder.finish(RunSummary({}))
    return folder


@pytest.fixture(scope="module")
def log(run, tmp_path_factory) -> BtLog:
    file = tmp_path_factory.mktemp("log") / "run.btlog"
    file.write_bytes(btlog_of_run(run, registered_nodes()))
    return read_btlog(file)


def test_statuses_of_every_node_at_every_tick_come_back(run, log):
    moments = list(read_decisions(run).moments())
    assert len({path for m in moments for path in m.nodes}) > 20
    changes = list(log.changes)
    now = dict.fromkeys(log.names.values(), IDLE)
    for moment in moments:
        while changes and changes[0][0] <= round(1e6 * moment.time_s):
            _, number, status = changes.pop(0)
            now[log.names[number]] = status
        said = {p: NAMES[w.status] if w.ticked else IDLE for p, w in moment.nodes.items()}
        assert {path: now[path] for path in said} == said, moment.tick
    assert not changes


def test_only_changes_are_written_in_order_of_time(log):
    times = [at for at, _, _ in log.changes]
    assert times == sorted(times)
    last = dict.fromkeys(log.names, IDLE)
    for _, number, status in log.changes:
        assert status != last[number]
        last[number] = status


def test_numbers_are_unique_and_actions_stand_under_the_slot(log):
    assert sorted(log.names) == list(range(1, len(log.names) + 1))
    actions = [name for name in log.names.values() if "/act/" in name]
    assert "fras/operate/act/4_pull_psm1" in actions
    assert len(actions) == len(set(actions)) == 4, "each once, although there were two plans"


def test_the_xml_has_a_model_for_every_node_as_the_loggers_have(log):
    document = minidom.parseString(log.xml)
    (models,) = document.getElementsByTagName("TreeNodesModel")
    known = {
        m.getAttribute("ID"): m.tagName for m in models.childNodes if isinstance(m, minidom.Element)
    }
    (tree,) = document.getElementsByTagName("BehaviorTree")
    assert {element.tagName for element in tree.getElementsByTagName("*")} == set(known)
    assert known["ReactiveSequence"] == known["DefrasPlanSlot"] == "Control"
    assert known["Inverter"] == "Decorator"
    assert known["SensorsFresh"] == "Condition"
    assert known["Pull"] == "Action"
