"""LetGo opens every jaw that holds, on the spot, and blocks the points they held."""

from py_trees.common import Status

from defras_bt.acting.jaw import JAW_TIME_OUT_S
from defras_bt.acting.let_go import LetGo
from defras_sim.worlds.protocol import JAW_OPEN_RAD


def test_with_nothing_held_there_is_nothing_to_do(bench):
    node = bench.node(LetGo)
    assert bench.tick(node) == Status.SUCCESS
    assert node.code == "let_go"
    assert bench.board.command.arms == {}


def test_it_opens_every_holding_jaw_and_moves_no_tip(bench):
    bench.hold((2, 4), "psm1")
    bench.hold((2, 2), "psm2")
    before = {arm: bench.tip_m(arm).copy() for arm in ("psm1", "psm2")}
    node = bench.node(LetGo)
    assert bench.tick(node) == Status.RUNNING
    assert node.code == "opening"
    assert [bench.commanded_jaw_rad(arm) for arm in before] == [JAW_OPEN_RAD] * 2
    assert bench.run(node) == Status.SUCCESS
    assert bench.board.grips == {}
    for arm, tip_m in before.items():
        assert (bench.tip_m(arm) == tip_m).all()


def test_it_leaves_the_jaw_of_an_arm_without_grip_alone(bench):
    bench.hold((2, 4), "psm1")
    bench.tick(bench.node(LetGo))
    assert set(bench.board.command.arms) == {"psm1"}


def test_points_that_were_let_go_are_blocked_and_told_of_once(bench):
    bench.hold((2, 4))
    bench.world.stuck.add("psm1")
    node = bench.node(LetGo)
    bench.tick(node)
    assert bench.board.blocked == {(2, 4)}
    assert len(bench.told("hold")) == 1
    assert "(2, 4)" in bench.told("hold")[0]
    bench.tick(node)
    assert bench.told("hold") == []


def test_afterwards_the_arm_counts_as_being_at_no_point(bench):
    bench.hold((2, 4))
    bench.run(bench.node(LetGo))
    assert bench.board.at == {}


def test_a_jaw_that_stays_shut_needs_a_human(bench):
    bench.hold((2, 4))
    bench.world.stuck.add("psm1")
    node = bench.node(LetGo)
    assert bench.run(node) == Status.FAILURE
    assert node.code == "jaw_stuck"
    assert JAW_TIME_OUT_S < bench.world.time_s < JAW_TIME_OUT_S + 0.2
    assert bench.board.outcome == "human"
    assert "PSM1 should let go" in bench.board.outcome_reason
    assert len(bench.told("human")) == 1


def test_tissue_that_slipped_may_be_grasped_there_once_more(bench):
    node = bench.node(LetGo, again=True)
    bench.hold((2, 4))
    bench.tick(node)
    assert "may be grasped there once more" in bench.told("hold")[0]
    assert bench.run(node) == Status.SUCCESS
    assert bench.board.blocked == set()
    bench.hold((2, 4))
    bench.tick(node)
    assert "will not be used again" in bench.told("hold")[0]
    assert bench.board.blocked == {(2, 4)}


def test_an_interrupted_release_does_not_count_twice(bench):
    bench.world.stuck.add("psm1")
    bench.hold((2, 4))
    for _ in range(3):
        bench.tick(bench.node(LetGo, again=True))
    assert bench.board.blocked == set()
