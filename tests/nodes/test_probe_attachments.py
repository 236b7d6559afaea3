"""ProbeAttachments tugs once where learning was left in doubt, and only as the model advises."""

import numpy as np
import pytest
from py_trees.common import Status

from defras_bt.executive.testing import flat_cloud_m
from defras_bt.learning.estimate import AttachmentEstimate
from defras_bt.learning.probe.choice import Tug
from defras_bt.learning.probe.nodes import ProbeAttachments
from defras_sim.worlds.protocol import PointCloud

WAY_M = np.array([0.004, 0.0, 0.003])


@pytest.fixture
def probe(bench):
    """Tissue is held and was seen; learning left four holes in doubt; a tug is advised."""
    grip = bench.hold()
    tips = {"psm1": grip.grasp_tip}
    bench.keyframes.add(0.0, tips, tips, PointCloud(0.0, flat_cloud_m()))
    bench.board.posterior = doubtful(bench)
    bench.probe.tug = Tug("psm1", WAY_M, parts_m=0.004, now_m=0.001, force_n=0.05)
    return bench.node(ProbeAttachments)


def doubtful(bench, doubt: float = 0.4) -> AttachmentEstimate:
    attached = bench.scene.attached
    probability = attached.astype(float)
    probability[:4] = np.where(attached[:4], 1 - doubt, doubt)
    return AttachmentEstimate(attached, probability, 0.001, 0.001, False, "in doubt")


def test_it_goes_the_advised_way_at_half_speed_and_ends(bench, probe):
    start_m = bench.tip_m().copy()
    assert bench.tick(probe) == Status.RUNNING
    (sentence,) = bench.told("probe")
    assert "5 mm" in sentence
    assert "4.0 mm instead of 1.0 mm" in sentence
    velocity = bench.commanded_m_s()
    np.testing.assert_allclose(velocity / np.linalg.norm(velocity), WAY_M / 0.005, atol=1e-9)
    assert np.linalg.norm(velocity) == pytest.approx(0.5 * bench.scene.motion.tissue_speed_m_s)
    assert bench.run(probe) == Status.SUCCESS
    assert probe.code == "probed"
    np.testing.assert_allclose(bench.tip_m(), start_m + WAY_M, atol=3e-4)
    assert bench.probe.asked == [2], "chosen once, between the belief and one other"


def test_one_tug_for_one_attempt_to_learn(bench, probe):
    bench.run(probe)
    assert bench.tick(probe) == Status.FAILURE
    assert probe.code == "not_doubtful"
    assert bench.commanded_m_s().any() == np.False_


def test_what_is_sure_is_not_probed(bench, probe):
    bench.board.posterior = doubtful(bench, doubt=0.05)
    assert bench.tick(probe) == Status.FAILURE
    assert probe.code == "not_doubtful"
    assert bench.probe.asked == []


def test_without_a_safe_tug_nothing_moves(bench, probe):
    bench.probe.tug = None
    assert bench.tick(probe) == Status.FAILURE
    assert probe.code == "no_safe_tug"
    assert bench.board.command.arms == {}
    bench.tick(probe)
    assert len(bench.probe.asked) == 1, "not asked again every tick"


def test_without_a_grip_nothing_moves(bench):
    node = bench.node(ProbeAttachments)
    assert bench.tick(node) == Status.FAILURE
    assert node.code == "nothing_held"


def test_tissue_lost_on_the_way_ends_it(bench, probe):
    bench.tick(probe)
    bench.world.tools["psm1"].grasped = False
    assert bench.tick(probe) == Status.FAILURE
    assert bench.board.command.arms == {}
