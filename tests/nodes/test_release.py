"""Release lets the tissue go where it is."""

from py_trees.common import Status

from defras_bt.acting.jaw import JAW_TIME_OUT_S, Release
from defras_sim.worlds.protocol import JAW_OPEN_RAD


def test_it_opens_until_nothing_is_held(bench):
    bench.hold((2, 4))
    node = bench.node(Release, arm="psm1", point=(2, 4))
    assert bench.tick(node) == Status.RUNNING
    assert node.code == "opening"
    assert bench.commanded_jaw_rad() == JAW_OPEN_RAD
    assert not bench.commanded_m_s().any()
    assert bench.run(node) == Status.SUCCESS
    assert node.code == "done"
    assert bench.board.grips == {}
    assert bench.twin.holding == set()
    assert bench.told("action") == ["PSM1 has released the tissue."]


def test_after_a_release_the_arm_counts_as_being_at_no_point(bench):
    """The tissue fell back: whoever wants to grasp there again has to reach for it."""
    bench.hold((2, 4))
    bench.run(bench.node(Release, arm="psm1", point=(2, 4)))
    assert bench.board.at == {}


def test_the_manoeuvres_done_are_forgotten_with_the_grip(bench):
    bench.hold((2, 4), done=("pull", "fold"))
    bench.run(bench.node(Release, arm="psm1", point=(2, 4)))
    assert bench.hold((2, 4)).done == ()


def test_a_stuck_jaw_is_reported_and_the_grip_stays_known(bench):
    bench.hold((2, 4))
    bench.world.stuck.add("psm1")
    node = bench.node(Release, arm="psm1", point=(2, 4))
    assert bench.run(node) == Status.FAILURE
    assert node.code == "jaw_stuck"
    assert bench.world.time_s > JAW_TIME_OUT_S
    assert "psm1" in bench.board.grips
