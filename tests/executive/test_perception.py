"""Perception keeps twin, monitor, keyframes and grips in step with what is observed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from defras_bt.executive.blackboard import LearningAttempt
from defras_bt.executive.perception import Perception
from defras_bt.executive.testing import EPSILON_N, MU_M, NodeBench
from defras_bt.recording.operator_state import NOBODY, Mode, OperatorState
from defras_sim.geometry import Pose
from defras_sim.tissue.grasp import NothingToGrasp
from defras_sim.worlds.protocol import JAW_CLOSED_RAD, JAW_OPEN_RAD, ArmCommand, Command

NAN = float("nan")
TICK_S = 0.05


class Senses:
    """A bench with perception alone: no tree, the test moves the tools."""

    def __init__(self) -> None:
        self.bench = NodeBench()
        self.operator = NOBODY
        bench = self.bench
        self.perception = Perception(
            bench.board,
            bench.twin,
            bench.monitor,
            bench.keyframes,
            EPSILON_N,
        )

    def look(self):
        """The inputs of this tick; then a tick passes."""
        world = self.bench.world
        inputs = self.perception.update(world.ticks, world.observe(), self.operator)
        world.step()
        return inputs

    def turn_jaw(self, jaw_rad: float) -> None:
        self.bench.world.command(Command({"psm1": ArmCommand(jaw_rad=jaw_rad)}))
        for _ in range(6):
            self.look()

    def grasp(self) -> None:
        self.bench.put("psm1", (*self.bench.scene.grasp_xy_m(2, 4), 0.0))
        self.bench.board.at["psm1"] = (2, 4)
        # No arm gets there within a tick, unless by hand.
        self.operator = OperatorState(Mode.TAKEN_OVER, "the operator drives")
        self.look()
        self.operator = NOBODY
        self.turn_jaw(JAW_OPEN_RAD)
        self.turn_jaw(JAW_CLOSED_RAD)


@pytest.fixture
def senses() -> Senses:
    return Senses()


class TestMissingReadings:
    """Whatever is not there is said in words."""

    def test_all_is_there(self, senses):
        inputs = senses.look()
        assert inputs.missing == ()
        assert (inputs.tick, inputs.time_s) == (0, 0.0)
        assert inputs.force_threshold_n == EPSILON_N

    @pytest.mark.parametrize(("sensor", "word"), [("cloud_m", "cloud"), ("visibility", "visib")])
    def test_a_silent_camera(self, senses, sensor, word):
        setattr(senses.bench.world, sensor, None)
        missing = senses.look().missing
        assert missing
        assert all(word in sentence for sentence in missing), missing

    def test_a_tip_that_is_not_a_number(self, senses):
        senses.bench.put("psm2", (NAN, 0.0, 0.0))
        (sentence,) = senses.look().missing
        assert "psm2" in sentence

    def test_a_visibility_that_is_not_a_share(self, senses):
        senses.bench.world.visibility = 1.2
        assert any("1.2" in sentence for sentence in senses.look().missing)

    def test_what_the_operator_wants_is_passed_on_every_tick(self, senses):
        assert senses.look().operator.forbids is None
        senses.operator = OperatorState(Mode.STOPPED, "the pedal is pressed")
        assert senses.look().operator.forbids == "the pedal is pressed"


class TestForce:
    """Time over the threshold is counted without a break; the unknown counts as over."""

    @pytest.mark.parametrize("force_n", [0.31, NAN, float("inf")])
    def test_over_or_unknown(self, senses, force_n):
        senses.grasp()
        senses.bench.twin.feels_n = force_n
        for ticks in (1, 2, 3):
            np.testing.assert_equal(senses.look().force_n, force_n)
            assert senses.bench.board.force_over_s == pytest.approx(ticks * TICK_S)

    def test_a_moment_below_starts_the_count_anew(self, senses):
        senses.grasp()
        for force_n, over_s in ((0.4, 0.05), (0.4, 0.1), (0.3, 0.0), (0.4, 0.05)):
            senses.bench.twin.feels_n = force_n
            senses.look()
            assert senses.bench.board.force_over_s == pytest.approx(over_s)


class TestMonitoring:
    """Rest frames before the first grasp, readings once calibrated."""

    def test_no_reading_before_calibration(self, senses):
        assert senses.look().reading is None

    def test_afterwards_the_states_are_passed_on(self, senses):
        for _ in range(3):
            senses.look()
        senses.bench.monitor.warn(2, "local")
        reading = senses.look().reading
        assert reading.warning_state == {"local": 2, "median": 0}
        assert reading.mu_m["local"] == MU_M[2]

    def test_rest_frames_are_taken_only_from_tissue_that_nobody_holds(self, senses):
        senses.grasp()
        frames = senses.bench.monitor.rest_frames
        senses.look()
        assert senses.bench.monitor.rest_frames == frames

    def test_rest_is_what_was_seen_before_the_first_grasp(self, senses):
        senses.grasp()
        senses.turn_jaw(JAW_OPEN_RAD)
        assert senses.bench.board.grips == {}
        frames = senses.bench.monitor.rest_frames
        senses.look()
        assert senses.bench.monitor.rest_frames == frames

    def test_rest_frames_end_with_the_calibration(self, senses):
        senses.bench.board.rest_calibrated = True
        senses.look()
        assert senses.bench.monitor.rest_frames == 0


class TestUnlikelyReadings:
    """Well-formed readings that cannot be true."""

    def test_a_clock_that_stands_still(self, senses):
        senses.look()
        senses.bench.world.ticks -= 1
        assert senses.look().missing == ("the world's clock stands still at 0.00 s",)
        assert senses.look().missing == ()

    def test_a_tip_that_jumps_is_missing_until_it_is_back(self, senses):
        senses.look()
        home_m = senses.bench.tip_m()
        senses.bench.put("psm1", home_m + [0.02, 0.0, 0.0])
        for _ in range(3):
            (sentence,) = senses.look().missing
            assert "psm1 is 20.0 mm away from where it can be" in sentence
        senses.bench.put("psm1", home_m)
        assert senses.look().missing == ()

    @pytest.mark.parametrize(
        ("mode", "believed"), [(Mode.PAUSED, False), (Mode.STOPPED, False), (Mode.TAKEN_OVER, True)]
    )
    def test_only_driving_by_hand_explains_a_jump(self, senses, mode, believed):
        senses.look()
        senses.bench.put("psm1", senses.bench.tip_m() + [0.02, 0.0, 0.0])
        assert senses.look().missing
        senses.operator = OperatorState(mode, "the operator wants it so")
        senses.look()
        senses.operator = NOBODY
        assert (senses.look().missing == ()) is believed

    def test_messages_that_overtake_each_other_do_not_turn_time_back(self, senses):
        world = senses.bench.world
        old = world.observe()
        for _ in range(3):
            command = Command({"psm1": ArmCommand(np.array([0.0, 0.0, 0.05]))})
            senses.perception.sent(world.time_s, command)
            world.command(command)
            seen = senses.look()
        late = senses.perception.update(world.ticks, replace(world.observe(), arms=old.arms))
        assert late.missing == ()
        assert late.observation.arms == seen.observation.arms

    def test_what_a_world_says_that_it_stopped_is_missing_for_as_long(self, senses):
        why = "PSM1: is PAUSED; only an arm that is ENABLED moves"
        world = senses.bench.world
        stopped = replace(world.observe(), stopped={"psm1": why})
        assert senses.perception.update(0, stopped).missing == (why,)
        world.step()
        assert senses.look().missing == ()


class TestGrips:
    """A grip begins and ends with what the jaw says."""

    def test_a_grip_begins(self, senses):
        senses.grasp()
        bench = senses.bench
        grip = bench.board.grips["psm1"]
        assert (grip.point, grip.done) == ((2, 4), ())
        np.testing.assert_array_equal(grip.grasp_tip.position_m, bench.tip_m())
        assert bench.twin.holding == {"psm1"}
        assert bench.monitor.changes == 1

    def test_a_grip_ends(self, senses):
        senses.grasp()
        bench = senses.bench
        bench.board.unexplained = True
        bench.board.last_learning = LearningAttempt(0, 2, {})
        senses.turn_jaw(JAW_OPEN_RAD)
        assert bench.board.grips == {}
        assert bench.board.at == {}
        assert bench.twin.holding == set()
        assert bench.board.last_learning is None
        assert not bench.board.unexplained
        assert bench.monitor.changes == 2
        assert bench.monitor.settling, "released tissue may swing back without a warning"

    def test_shapes_are_kept_while_tissue_is_held_and_forgotten_with_the_grip(self, senses):
        keyframes = senses.bench.keyframes
        senses.look()
        assert keyframes.frames() == ()
        senses.grasp()
        assert keyframes.frames()
        assert set(keyframes.frames()[-1].grasp_tips) == {"psm1"}
        senses.turn_jaw(JAW_OPEN_RAD)
        assert keyframes.frames() == ()

    def test_a_missing_cloud_adds_no_shape(self, senses):
        senses.grasp()
        last_s = senses.bench.keyframes.frames()[-1].stamp_s
        senses.bench.world.cloud_m = None
        senses.look()
        assert senses.bench.keyframes.frames()[-1].stamp_s == last_s

    def test_a_grip_that_begins_on_the_way_off_is_at_the_nearest_grasp_point(self, senses):
        senses.grasp()
        senses.turn_jaw(JAW_OPEN_RAD)
        assert senses.bench.board.at == {}
        senses.turn_jaw(JAW_CLOSED_RAD)
        assert senses.bench.board.grips["psm1"].point == (2, 4)

    def test_a_jaw_that_does_not_tell_holds_what_it_held(self, senses):
        senses.grasp()
        bench = senses.bench
        seen = bench.world.observe()
        silent = {name: replace(arm, grasped=None) for name, arm in seen.arms.items()}
        senses.perception.update(99, replace(seen, arms=silent))
        assert set(bench.board.grips) == bench.twin.holding == {"psm1"}

    @pytest.mark.parametrize("lost", ["no reading", "no number"])
    def test_of_an_arm_that_holds_and_is_lost_nothing_is_known(self, senses, lost):
        senses.grasp()
        bench = senses.bench
        seen = bench.world.observe()
        arms = dict(seen.arms)
        if lost == "no reading":
            del arms["psm1"]
        else:
            nowhere = Pose(np.full(3, NAN))
            arms["psm1"] = replace(arms["psm1"], setpoint_tissue_from_tip=nowhere, grasped=False)
        inputs = senses.perception.update(99, replace(seen, arms=arms))
        assert any("psm1" in sentence for sentence in inputs.missing)
        assert (inputs.twin, inputs.reading) == (None, None)
        assert np.isnan(inputs.force_n)
        assert bench.board.force_over_s == pytest.approx(TICK_S)
        assert set(bench.board.grips) == bench.twin.holding == {"psm1"}
        assert not np.isnan(senses.look().force_n)

    def test_a_grip_where_the_twin_has_no_tissue_is_a_reading_that_cannot_be(self, senses):
        def nothing_there(arm, tip, time_s):
            raise NothingToGrasp("the tip is 40.0 mm from the tissue")

        senses.look()
        seen = senses.bench.world.observe()
        false = {**seen.arms, "psm2": replace(seen.arms["psm2"], grasped=True)}
        senses.bench.twin.grasp = nothing_there
        inputs = senses.perception.update(99, replace(seen, arms=false))
        assert inputs.missing == (
            "psm2 says that it holds tissue, but the tip is 40.0 mm from the tissue",
        )
        assert senses.bench.board.grips == {}
        senses.bench.world.step()
        assert senses.look().missing == (), "a moment later the jaw tells the truth"
