"""What holds for each manoeuvre: pull, move and fold differ only in where they go."""

from __future__ import annotations

import numpy as np
import pytest
from py_trees.common import Status

from defras_bt.acting.arm_action import ARRIVED_M
from defras_bt.acting.manoeuvre import SETTLE_S, Manoeuvre
from defras_bt.executive.testing import NodeBench


class ManoeuvreChecks:
    """Inherit and set ``leaf``; ``target_m(bench, start_m)`` says independently where it ends."""

    leaf: type[Manoeuvre]

    def target_m(self, bench, start_m):
        raise NotImplementedError

    @pytest.fixture
    def start_m(self, bench: NodeBench):
        """Held tissue, 20 mm up."""
        bench.hold((2, 4))
        bench.put("psm1", bench.tip_m() + [0.0, 0.0, 0.02])
        return bench.tip_m().copy()

    @pytest.fixture
    def node(self, bench: NodeBench):
        return bench.node(self.leaf, arm="psm1", point=(2, 4))

    def test_it_goes_straight_to_its_end(self, bench, start_m, node):
        end_m = self.target_m(bench, start_m)
        way = (end_m - start_m) / np.linalg.norm(end_m - start_m)
        limit = bench.scene.motion.tissue_speed_m_s
        start_s = bench.world.time_s
        while bench.tick(node) == Status.RUNNING and node.code == "moving":
            assert bench.world.time_s - start_s < 10.0, "never arrives"
            velocity = bench.commanded_m_s()
            assert np.linalg.norm(velocity) <= limit + 1e-12
            np.testing.assert_allclose(velocity / np.linalg.norm(velocity), way, atol=1e-6)
        np.testing.assert_allclose(bench.tip_m(), end_m, atol=ARRIVED_M)
        assert set(bench.world.sent[-2].arms) == {"psm1"}

    def test_it_lets_the_tissue_settle_before_it_is_done(self, bench, start_m, node):
        bench.put("psm1", self.target_m(bench, start_m))
        bench.board.grips["psm1"].starts_m[self.leaf.spoken] = start_m
        started_s = bench.world.time_s
        assert bench.tick(node) == Status.RUNNING
        assert node.code == "settling"
        assert bench.run(node) == Status.SUCCESS
        settled_s = bench.world.time_s - started_s - bench.scene.tick_s
        assert settled_s == pytest.approx(SETTLE_S, abs=bench.scene.tick_s + 1e-9)
        assert all(not command.arms for command in bench.world.sent)

    def test_pushed_away_while_it_settles_it_returns_and_settles_anew(self, bench, start_m, node):
        end_m = np.asarray(self.target_m(bench, start_m), float)
        bench.board.grips["psm1"].starts_m[self.leaf.spoken] = start_m
        codes = []
        for offset_m in (0.0, 0.0, 0.0, 0.001):
            bench.put("psm1", end_m + [0.0, offset_m, 0.0])
            bench.tick(node)
            codes.append(node.code)
        assert codes == ["settling"] * 3 + ["moving"]
        back_s = bench.world.time_s
        assert bench.run(node) == Status.SUCCESS
        assert bench.world.time_s - back_s >= SETTLE_S - 1e-9

    def test_it_is_counted_and_remembered(self, bench, start_m, node):
        bench.board.grips["psm1"].done = ("something",)
        assert bench.run(node) == Status.SUCCESS
        assert node.code == "done"
        assert bench.board.grips["psm1"].done == ("something", self.leaf.spoken)
        assert len(bench.told("action")) == 1
        assert bench.board.events[-1].data == {"action": self.leaf.spoken, "arm": "psm1"}

    def test_interrupted_it_goes_on_to_its_old_end(self, bench, start_m, node):
        end_m = self.target_m(bench, start_m)
        for _ in range(10):
            bench.tick(node)
        node.stop(Status.INVALID)
        assert bench.tip_m() != pytest.approx(start_m)
        again = bench.node(self.leaf, arm="psm1", point=(2, 4))
        assert bench.run(again) == Status.SUCCESS
        np.testing.assert_allclose(bench.tip_m(), end_m, atol=ARRIVED_M)

    def test_after_a_new_grasp_it_starts_from_there(self, bench, start_m, node):
        bench.tick(node)
        bench.board.grips.clear()
        bench.twin.holding.clear()
        bench.hold((2, 4))
        fresh_m = bench.tip_m().copy()
        again = bench.node(self.leaf, arm="psm1", point=(2, 4))
        assert bench.run(again) == Status.SUCCESS
        np.testing.assert_allclose(bench.tip_m(), self.target_m(bench, fresh_m), atol=ARRIVED_M)

    @pytest.mark.parametrize("held", [None, (3, 4)])
    def test_without_its_own_grip_it_does_not_move(self, bench, node, held):
        if held is not None:
            bench.hold(held)
        assert bench.tick(node) == Status.FAILURE
        assert node.code == "not_holding"
        assert bench.board.command.arms == {}

    def test_tissue_that_slips_off_ends_it(self, bench, start_m, node):
        bench.tick(node)
        bench.world.tools["psm1"].grasped = False
        assert bench.tick(node) == Status.FAILURE
        assert node.code == "not_holding"
        assert bench.board.command.arms == {}
