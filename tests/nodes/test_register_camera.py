"""RegisterCamera believes that the camera stands where it was found to stand."""

from __future__ import annotations

import numpy as np
import pytest
from py_trees.common import Status

from defras_bt.diagnosis.mismatch.finding import MismatchFinding
from defras_bt.diagnosis.mismatch.nodes import RegisterCamera
from defras_bt.executive.testing import flat_cloud_m
from defras_sim.geometry import Pose
from defras_sim.worlds.protocol import PointCloud

MOVED = Pose(np.array([0.003, 0.0, 0.0]))


@pytest.fixture
def node(bench):
    grip = bench.hold()
    tips = {"psm1": grip.grasp_tip}
    bench.keyframes.add(0.0, tips, tips, PointCloud(0.0, flat_cloud_m()))
    bench.board.mismatch = MismatchFinding("camera", "it was bumped", true_from_reported=MOVED)
    return bench.node(RegisterCamera)


def test_twin_and_monitoring_learn_of_it(bench, node):
    bench.board.unexplained = True
    assert bench.tick(node) == Status.SUCCESS
    assert node.code == "registered"
    assert bench.twin.registered == [MOVED]
    assert bench.monitor.changes == 1
    assert not bench.board.unexplained
    assert bench.told("diagnosis") == ["The camera was registered anew: it was bumped."]


def test_shapes_seen_from_elsewhere_are_forgotten(bench, node):
    bench.tick(node)
    assert bench.keyframes.frames() == ()


def test_it_is_done_once(bench, node):
    bench.tick(node)
    assert bench.tick(node) == Status.FAILURE
    assert node.code == "not_blamed"
    assert bench.twin.registered == [MOVED]


def test_a_place_where_no_camera_stands_is_refused(bench, node, monkeypatch):
    def refuse(true_from_reported: Pose) -> None:
        raise ValueError("x_m should be between -0.05 and 0.05 m, is 0.2")

    monkeypatch.setattr(bench.twin, "register_camera", refuse)
    assert bench.tick(node) == Status.FAILURE
    assert node.code == "rejected"
    assert bench.board.unexplained
    assert bench.monitor.changes == 0


def test_it_never_commands(bench, node):
    bench.tick(node)
    assert bench.board.command.arms == {}
