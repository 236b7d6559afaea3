"""Nothing leaves the gate that is too fast, leads out of the workspace, or follows a trip."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from defras_bt.executive.blackboard import TickInputs
from defras_bt.executive.gate import (
    ABOVE_TISSUE_M,
    BELOW_SURFACE_M,
    BESIDE_TISSUE_M,
    FORCE_PATIENCE_S,
    CommandGate,
    GateVerdict,
    Proposal,
)
from defras_bt.executive.testing import bench_scene, flat_cloud_m, flat_state
from defras_bt.monitoring.reading import MonitorReading
from defras_bt.recording.operator_state import Mode, OperatorState
from defras_sim.arm.closed_form import joints_of
from defras_sim.arm.dh import JOINT_SPEED
from defras_sim.arm.kinematics import Unreachable, joints_for
from defras_sim.geometry import Pose
from defras_sim.worlds.kinematic_tool import POINTING_DOWN
from defras_sim.worlds.protocol import (
    HOLD,
    JAW_CLOSED_RAD,
    JAW_OPEN_RAD,
    ArmCommand,
    ArmObservation,
    Command,
    Observation,
    PointCloud,
)

SCENE = bench_scene()
GATE = CommandGate(SCENE, "local")
NAN = float("nan")
UP = np.array([0.0, 0.0, 1.0])
HALF_M = 0.06 + BESIDE_TISSUE_M


def arm(tip_m=(0.0, 0.03, 0.03), grasped=False) -> ArmObservation:
    tip = Pose(np.array(tip_m, float), POINTING_DOWN)
    return ArmObservation(0.0, tip, tip, 0.0, grasped)


def reading(state: int = 0, mu_m: float = 0.0005) -> MonitorReading:
    return MonitorReading(0.0, {"local": mu_m}, {"local": state})


def inputs(arms=None, **says) -> TickInputs:
    """Inputs that trip nothing, except for what the test says."""
    arms = {"psm1": arm(), "psm2": arm((0.0, -0.03, 0.03))} if arms is None else arms
    plain = TickInputs(
        tick=0,
        time_s=0.0,
        observation=Observation(0.0, arms),
        missing=(),
        twin=flat_state(),
        force_n=0.1,
        force_threshold_n=0.3,
        reading=reading(),
    )
    return replace(plain, **says)


def go(velocity=0.01 * UP, jaw_rad=0.8, **other) -> Command:
    return Command({"psm1": ArmCommand(np.array(velocity, float), jaw_rad=jaw_rad, **other)})


def check(
    command: Command,
    rate: float,
    known: TickInputs,
    *,
    gate: CommandGate = GATE,
    acting: bool = True,
    late_s: float = 0.0,
) -> GateVerdict:
    """What ``gate`` makes of a command that an action proposed in time, if not said otherwise."""
    return gate.check(Proposal(command, rate, acting, known.time_s + late_s), known)


def speed_m_s(command: Command, name: str = "psm1") -> float:
    return float(np.linalg.norm(command.arms.get(name, ArmCommand()).linear_m_s))


class TestWithoutTrip:
    """Speed, rate and workspace."""

    def test_a_threshold_that_is_not_a_number_slows(self):
        known = inputs(force_n=0.1, force_threshold_n=NAN)
        sent = check(go(0.004 * UP), 1.0, known).command
        slowed = check(go(0.004 * UP), 1.0, inputs(force_n=0.31)).command
        np.testing.assert_array_equal(sent.arms["psm1"].linear_m_s, slowed.arms["psm1"].linear_m_s)
        assert speed_m_s(sent) < 0.004

    def test_a_slow_command_passes_unchanged(self):
        verdict = check(go(), 1.0, inputs())
        sent = verdict.command.arms["psm1"]
        np.testing.assert_allclose(sent.linear_m_s, 0.01 * UP)
        assert sent.jaw_rad == 0.8
        assert verdict.reasons == ()

    @pytest.mark.parametrize(
        ("grasped", "limit"),
        [
            (False, SCENE.motion.reach_speed_m_s),
            (True, SCENE.motion.tissue_speed_m_s),
            (None, SCENE.motion.tissue_speed_m_s),
        ],
    )
    def test_a_fast_one_is_clipped_and_keeps_its_direction(self, grasped, limit):
        velocity = np.array([0.3, -0.4, 1.2])
        verdict = check(go(velocity), 1.0, inputs({"psm1": arm(grasped=grasped)}))
        sent = verdict.command.arms["psm1"].linear_m_s
        np.testing.assert_allclose(sent, velocity * limit / 1.3)

    def test_while_one_arm_holds_tissue_the_other_is_slow_too(self):
        held = {"psm1": arm(), "psm2": arm((0.0, -0.03, 0.03), grasped=True)}
        verdict = check(go(1.0 * UP), 1.0, inputs(held))
        assert speed_m_s(verdict.command) == pytest.approx(SCENE.motion.tissue_speed_m_s)

    @pytest.mark.parametrize("rate", [0.0, 0.5, 1.0])
    def test_the_rate_scales_slow_and_clipped_commands_alike(self, rate):
        for proposed, full in ((0.01, 0.01), (1.0, SCENE.motion.reach_speed_m_s)):
            verdict = check(go(proposed * UP), rate, inputs())
            assert speed_m_s(verdict.command) == pytest.approx(rate * full)

    def test_turning_is_limited_and_scaled_too(self):
        command = go(angular_rad_s=np.array([3.0, 0.0, 4.0]))
        sent = check(command, 0.5, inputs()).command.arms["psm1"].angular_rad_s
        np.testing.assert_allclose(sent, [0.3, 0.0, 0.4])

    @pytest.mark.parametrize("axis", [0, 1, 2])
    @pytest.mark.parametrize("side", [-1, 1])
    def test_motion_ends_at_the_wall_of_the_workspace(self, axis, side):
        low, high = [-HALF_M, -HALF_M, -BELOW_SURFACE_M], [HALF_M, HALF_M, ABOVE_TISSUE_M]
        wall_m = (low, high)[side > 0][axis]
        name = "psm2" if (axis, side) == (1, -1) else "psm1"  # the arm that reaches that wall
        tip_m = np.array([0.0, 0.03 if axis == 2 else 0.0, 0.03])
        tip_m[axis] = wall_m - side * 0.0005
        velocity = np.zeros(3)
        velocity[axis] = side * 0.05
        command = Command({name: ArmCommand(velocity)})
        verdict = check(command, 1.0, inputs({name: arm(tip_m)}))
        moved_m = verdict.command.arms[name].linear_m_s * SCENE.tick_s
        assert moved_m[axis] == pytest.approx(side * 0.0005)

    def test_from_outside_only_the_way_back_is_open(self):
        outside = inputs({"psm1": arm((0.0, 0.0, ABOVE_TISSUE_M + 0.01))})
        assert speed_m_s(check(go(0.01 * UP), 1.0, outside).command) == 0.0
        assert speed_m_s(check(go(-0.01 * UP), 1.0, outside).command) == pytest.approx(0.01)

    def test_the_wall_is_where_the_tip_was_last_told_to_be(self):
        behind = arm((HALF_M - 0.002, 0.03, 0.03))
        ahead = replace(behind, goal_tissue_from_tip=arm((HALF_M, 0.03, 0.03)).tissue_from_tip)
        away = go(np.array([0.01, 0.0, 0.0]))
        assert speed_m_s(check(away, 1.0, inputs({"psm1": behind})).command) > 0.0
        assert speed_m_s(check(away, 1.0, inputs({"psm1": ahead})).command) == 0.0

    def test_outside_in_one_axis_motion_along_the_others_is_free(self):
        outside = inputs({"psm1": arm((0.0, 0.0, ABOVE_TISSUE_M + 0.01))})
        verdict = check(go([0.01, 0.0, 0.01]), 1.0, outside)
        np.testing.assert_allclose(verdict.command.arms["psm1"].linear_m_s, [0.01, 0.0, 0.0])


TISSUE_TRIPS = {
    "force unknown": ({"force_n": NAN}, "the force estimate is missing"),
    "warning state 2": ({"reading": reading(2)}, "the warning state is 2"),
    "warning state 3": ({"reading": reading(3)}, "the warning state is 3"),
    "mu unknown": ({"reading": reading(0, NAN)}, "the discrepancy is unknown"),
    "mu unknown in a high state": ({"reading": reading(3, NAN)}, "the discrepancy is unknown"),
    "no reading": ({"reading": None}, "the discrepancy is unknown"),
}
BLIND_TRIPS = {
    "something is missing": ({"missing": ("no cloud", "psm2 is old")}, "no cloud"),
    "the operator stops": (
        {"operator": OperatorState(Mode.STOPPED, "the pedal is pressed")},
        "the pedal is pressed",
    ),
}


class TestTrips:
    """On a trip no tip moves."""

    @pytest.mark.parametrize("name", TISSUE_TRIPS)
    def test_force_and_shape_stop_motion_and_leave_the_jaw_free_to_let_go(self, name):
        says, reason = TISSUE_TRIPS[name]
        verdict = check(go(), 1.0, inputs(**says))
        assert speed_m_s(verdict.command) == 0.0
        assert verdict.command.arms["psm1"].jaw_rad == 0.8
        assert verdict.reasons == (reason,)

    @pytest.mark.parametrize("name", BLIND_TRIPS)
    def test_without_sensors_or_leave_the_jaw_keeps_its_grip_too(self, name):
        says, reason = BLIND_TRIPS[name]
        verdict = check(go(), 1.0, inputs(**says))
        assert verdict.command == HOLD
        assert verdict.reasons[0] == reason

    def test_all_reasons_are_given(self):
        says = {"missing": ("no cloud",), "force_n": NAN, "reading": reading(2)}
        verdict = check(go(), 1.0, inputs(**says))
        assert verdict.reasons == (
            "no cloud",
            "the force estimate is missing",
            "the warning state is 2",
        )

    @pytest.mark.parametrize("state", [0, 1])
    def test_low_warning_states_trip_nothing(self, state):
        assert check(go(), 1.0, inputs(reading=reading(state))).reasons == ()

    @pytest.mark.parametrize("read", [None, reading(3), reading(3, NAN)])
    def test_a_tree_without_monitoring_is_not_stopped_by_it(self, read):
        verdict = check(go(), 1.0, inputs(reading=read), gate=CommandGate(SCENE, None))
        assert speed_m_s(verdict.command) == pytest.approx(0.01)


class TestFaultyCommands:
    """One fault, and nothing of the command is trusted, whatever the order of the arms."""

    FAULTS = (
        {"psm2": ArmCommand(np.array([NAN, 0.0, 0.0]))},
        {"psm2": ArmCommand(np.array([0.0, float("inf"), 0.0]))},
        {"psm2": ArmCommand(angular_rad_s=np.array([0.0, 0.0, NAN]))},
        {"psm2": ArmCommand(jaw_rad=NAN)},
        {"psm3": ArmCommand()},
    )

    @pytest.mark.parametrize("fault", FAULTS)
    @pytest.mark.parametrize("first", [True, False])
    def test_a_fault_for_one_arm_stops_both(self, fault, first):
        arms = {**fault, **go().arms} if first else {**go().arms, **fault}
        verdict = check(Command(arms), 1.0, inputs())
        assert verdict.command == HOLD
        (reason,) = verdict.reasons
        assert next(iter(fault)) in reason

    @pytest.mark.parametrize("rate", [-0.1, 1.1, NAN, float("inf")])
    def test_a_rate_that_is_none(self, rate):
        verdict = check(go(), rate, inputs())
        assert verdict.command == HOLD
        assert "not between 0 and 1" in verdict.reasons[0]

    def test_an_arm_whose_set_point_is_unknown_is_not_moved(self):
        lost = {"psm1": arm((NAN, 0.0, 0.0))}
        verdict = check(go(), 1.0, inputs(lost))
        assert verdict.command == HOLD
        assert verdict.reasons == ("the set-point of psm1 is not a number",)


def commands_of(arms: list[str], numbers: st.SearchStrategy[float]) -> st.SearchStrategy[Command]:
    vectors = st.tuples(numbers, numbers, numbers).map(np.array)
    one = st.builds(ArmCommand, vectors, vectors, st.none() | numbers)
    return st.dictionaries(st.sampled_from(arms), one).map(Command)


fast = commands_of(["psm1", "psm2"], st.floats(-1, 1))
wild = commands_of(["psm1", "psm2", "psm3"], st.floats(allow_nan=True, allow_infinity=True))
places = st.tuples(*[st.floats(-0.3, 0.3)] * 3)
trips = st.sampled_from([*TISSUE_TRIPS.values(), *BLIND_TRIPS.values()]).map(lambda trip: trip[0])


def keeps_joint_limits(name: str, start_m, sent: ArmCommand) -> bool:
    """By the iterative inverse kinematics, which knows nothing of the gate's closed form."""
    if not (sent.linear_m_s.any() or sent.angular_rad_s.any()):
        return True
    rcm_m = np.array(SCENE.arms[name].rcm_m)
    start = Pose(start_m - rcm_m, POINTING_DOWN)
    end = start.moved(sent.linear_m_s * SCENE.tick_s, sent.angular_rad_s * SCENE.tick_s)
    try:
        before = joints_for(start, joints_of(start))
    except Unreachable:
        return True  # the way back is open, and from where it begins nothing can be said
    after = joints_for(end, before)
    return bool((np.abs(after - before) <= JOINT_SPEED * SCENE.tick_s + 1e-6).all())


@given(
    proposed=fast | wild,
    rate=st.floats(0, 1) | st.floats(),
    tips=st.tuples(places, places),
    held=st.tuples(st.booleans(), st.booleans()),
    says=st.just({}) | trips,
)
@example(go([1e308, 1e308, -1e308]), 1.0, ((0, 0, 0), (0, 0, 0)), (False, False), {})
def test_whatever_is_proposed(proposed, rate, tips, held, says):
    """Speed is at most limit times rate, the box is not left, and a trip means motion zero."""
    arms = {f"psm{i + 1}": arm(tips[i], held[i]) for i in range(2)}
    with np.errstate(over="ignore"):
        verdict = check(proposed, rate, inputs(arms, **says))
    at_limits = {reason.split()[0] for reason in verdict.reasons if "is at its limits" in reason}
    stopped = bool(says) or len(verdict.reasons) > len(at_limits)
    limit = SCENE.motion.tissue_speed_m_s if any(held) else SCENE.motion.reach_speed_m_s
    low, high = [-HALF_M, -HALF_M, -BELOW_SURFACE_M], [HALF_M, HALF_M, ABOVE_TISSUE_M]
    assert set(verdict.command.arms) <= set(arms)
    for name, sent in verdict.command.arms.items():
        assert np.isfinite(sent.linear_m_s).all()
        assert np.isfinite(sent.angular_rad_s).all()
        assert sent.jaw_rad is None or JAW_CLOSED_RAD <= sent.jaw_rad <= JAW_OPEN_RAD
        if stopped or name in at_limits:
            assert not sent.linear_m_s.any()
            assert not sent.angular_rad_s.any()
            continue
        assert np.linalg.norm(sent.linear_m_s) <= limit * rate + 1e-12
        assert np.linalg.norm(sent.angular_rad_s) <= rate + 1e-12
        start = arms[name].setpoint_tissue_from_tip.position_m
        end = start + sent.linear_m_s * SCENE.tick_s
        assert (end >= np.minimum(start, low) - 1e-12).all()
        assert (end <= np.maximum(start, high) + 1e-12).all()
        assert keeps_joint_limits(name, start, sent)


class TestForce:
    """The gate slows and stops on force by itself, whatever the tree does."""

    def test_over_the_threshold_motion_is_halved(self):
        sent = check(go(), 1.0, inputs(force_n=0.31)).command
        assert speed_m_s(sent) == pytest.approx(0.005)

    def test_a_rate_that_is_halved_already_is_not_halved_again(self):
        sent = check(go(), 0.5, inputs(force_n=0.31)).command
        assert speed_m_s(sent) == pytest.approx(0.005)

    def test_too_long_over_the_threshold_nothing_moves_but_a_jaw_may_let_go(self):
        verdict = check(go(), 0.5, inputs(force_n=0.31, force_over_s=FORCE_PATIENCE_S))
        assert speed_m_s(verdict.command) == 0.0
        assert verdict.command.arms["psm1"].jaw_rad == 0.8
        assert "0.31 N" in verdict.reasons[0]


class TestJointLimits:
    """What the arm cannot do is not sent, and said."""

    DEEP = (0.0, -0.06, 0.0)  # psm1 reaches hardly farther across
    ACROSS = 0.01 * np.array([0.0, -1.0, 0.0])

    def test_motion_out_of_reach_is_stopped_with_its_reason(self):
        tip_m = np.array(self.DEEP)
        for _ in range(200):
            verdict = check(go(self.ACROSS), 1.0, inputs({"psm1": arm(tip_m)}))
            if verdict.reasons:
                break
            tip_m = tip_m + verdict.command.arms["psm1"].linear_m_s * SCENE.tick_s
        assert speed_m_s(verdict.command) == 0.0
        assert verdict.command.arms["psm1"].jaw_rad == 0.8, "the jaw is not out of reach"
        assert verdict.reasons[0].startswith("psm1 is at its limits: ")
        assert tip_m[1] < self.DEEP[1], "up to there it was let through"
        back = check(go(-self.ACROSS), 1.0, inputs({"psm1": arm(tip_m)}))
        assert speed_m_s(back.command) == pytest.approx(0.01)

    def test_the_other_arm_is_not_concerned(self):
        both = Command({"psm1": ArmCommand(self.ACROSS), "psm2": ArmCommand(0.01 * UP)})
        tips = {"psm1": arm((0.0, -0.15, 0.0)), "psm2": arm((0.0, -0.03, 0.03))}
        verdict = check(both, 1.0, inputs(tips))
        assert speed_m_s(verdict.command, "psm1") == 0.0
        assert speed_m_s(verdict.command, "psm2") == pytest.approx(0.01)

    @pytest.mark.parametrize(("asked", "sent"), [(9.0, JAW_OPEN_RAD), (-9.0, JAW_CLOSED_RAD)])
    def test_a_jaw_turns_no_farther_than_it_can(self, asked, sent):
        assert check(go(jaw_rad=asked), 1.0, inputs()).command.arms["psm1"].jaw_rad == sent


class TestLateness:
    """What the tree decided on has to be young enough when its command leaves."""

    LIMIT_S = SCENE.thresholds.max_age_s

    def test_a_tree_that_takes_its_time_but_not_too_much(self):
        verdict = check(go(), 1.0, sensed(), late_s=0.9 * self.LIMIT_S)
        assert verdict.reasons == ()

    def test_a_tree_that_returns_too_late_moves_nothing_and_no_jaw(self):
        verdict = check(go(), 1.0, sensed(), late_s=1.1 * self.LIMIT_S)
        assert verdict.command == HOLD
        assert "the tree took 0.55 s: psm1 is 0.55 s old" in verdict.reasons[0]

    @pytest.mark.parametrize("late_s", [-0.1, NAN])
    def test_a_clock_that_says_nonsense(self, late_s):
        assert check(go(), 1.0, sensed(), late_s=late_s).command == HOLD


def sensed() -> TickInputs:
    """Inputs with every reading, taken at time 0."""
    seen = Observation(
        0.0, inputs().observation.arms, PointCloud(0.0, flat_cloud_m()), None, None, 0.0, 0.0
    )
    return inputs(observation=seen)


class TestOwnership:
    """Motion has to come from an action that is under way."""

    def test_motion_of_an_action_that_was_ended_is_dropped_but_not_a_jaw_that_lets_go(self):
        verdict = check(go(), 1.0, inputs(), acting=False)
        assert speed_m_s(verdict.command) == 0.0
        assert verdict.command.arms["psm1"].jaw_rad == 0.8
        assert "no action was under way" in verdict.reasons[0]

    def test_a_jaw_alone_needs_no_action(self):
        verdict = check(Command({"psm1": ArmCommand(jaw_rad=0.8)}), 1.0, inputs(), acting=False)
        assert verdict.reasons == ()
        assert verdict.command.arms["psm1"].jaw_rad == 0.8


@pytest.mark.parametrize("shape", [(2,), (4,), (3, 3), ()])
def test_a_command_of_the_wrong_shape(shape):
    verdict = check(Command({"psm1": ArmCommand(np.full(shape, 0.01))}), 1.0, inputs())
    assert verdict.command == HOLD
    assert verdict.reasons == ("the command for psm1 has not three components",)
