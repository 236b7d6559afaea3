"""An arm that must not be driven is not, within 50 ms, with its grip kept and the reason told."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from defras_bt.dvrk.settings import Limits
from defras_bt.dvrk.transport.messages import JointMessage, Message, PoseMessage
from defras_sim.geometry import Pose
from tests.dvrk.toy_robot import BEGIN_S, PERIOD_S, DrivenArm, restamped

KNOWN_S = 0.05
"""So long after it could be known there may be motion."""


@pytest.fixture
def driven() -> DrivenArm:
    """An arm in motion."""
    driven = DrivenArm()
    driven.tick((0.0, 0.02, 0.0), jaw_rad=0.5)
    driven.go(10)
    assert driven.period()[1] > 0.0
    return driven


def ends(driven: DrivenArm, within_s: float = KNOWN_S) -> None:
    """Motion ends in time and stays at its end, whatever the executive wants."""
    for _ in range(round(within_s / PERIOD_S)):
        driven.period()
    count, jaw = len(driven.transport.sent), driven.arm.jaw_setpoint_rad
    for _ in range(6):
        driven.tick((0.0, 0.02, 0.0), jaw_rad=0.8)
        for _ in range(5):
            assert not driven.period().any()
    moved = {tuple(pose.position_m) for _, _, pose in driven.transport.sent[count - 1 :]}
    assert len(moved) == 1
    assert driven.arm.jaw_setpoint_rad == jaw, "what the jaw grips stays gripped"


def set_state(state: str) -> Callable[[DrivenArm], None]:
    def become(driven: DrivenArm) -> None:
        driven.arm.state = state

    return become


def unhome(driven: DrivenArm) -> None:
    driven.arm.is_homed = False


def be_busy(driven: DrivenArm) -> None:
    driven.arm.is_busy = True


def lose_master(driven: DrivenArm) -> None:
    driven.transport.gone = "the ROS master at http://robot:11311 is gone"


def spoil(change: Callable[[str, Message], Message | None]) -> Callable[[DrivenArm], None]:
    def become(driven: DrivenArm) -> None:
        driven.transport.spoil = lambda arm, topic, said: change(topic, said)

    return become


def without(*topics: str) -> Callable[[DrivenArm], None]:
    return spoil(lambda topic, said: None if topic in topics or not topics else said)


def stamped(late_s: float) -> Callable[[DrivenArm], None]:
    return spoil(lambda topic, said: restamped(said, said.stamp_s - late_s))


def delayed(late_s: float) -> Callable[[DrivenArm], None]:
    def become(driven: DrivenArm) -> None:
        waiting: defaultdict[str, deque[Message]] = defaultdict(deque)

        def late(arm: str, topic: str, said: Message) -> Message | None:
            waiting[topic].append(said)
            due = waiting[topic][0].stamp_s <= driven.transport.clock_s - late_s
            return waiting[topic].popleft() if due else None

        driven.transport.spoil = late

    return become


def in_frame(frame: str) -> Callable[[DrivenArm], None]:
    return spoil(
        lambda topic, said: replace(said, frame=frame) if isinstance(said, PoseMessage) else said
    )


def jaw_of(topic: str, *angles_rad: float) -> Callable[[DrivenArm], None]:
    return spoil(
        lambda of, said: (
            replace(said, position=np.array(angles_rad))
            if of == topic and isinstance(said, JointMessage)
            else said
        )
    )


def jump(driven: DrivenArm) -> None:
    driven.arm.measured = driven.arm.setpoint.moved(np.array([0.02, 0.0, 0.0]))


def not_a_number(driven: DrivenArm) -> None:
    driven.arm.measured = Pose(np.full(3, np.nan), np.eye(3))


FAULTS = {
    "PAUSED": (set_state("PAUSED"), "PSM1: is PAUSED"),
    "FAULT": (set_state("FAULT"), "PSM1: is FAULT"),
    "DISABLED": (set_state("DISABLED"), "PSM1: is DISABLED"),
    "unhomed": (unhome, "is not homed"),
    "a move of somebody else": (be_busy, "somebody else asked for"),
    "master gone": (lose_master, "the ROS master at http://robot:11311 is gone"),
    "silence": (without(), "ms old; at most 40 ms"),
    "no set-point": (without("setpoint_cp"), "its set-point is"),
    "no jaw": (without("jaw/measured_js"), "its jaw is"),
    "stamps turned back": (stamped(1.0), "s before the one before it"),
    "250 ms late": (delayed(0.25), "ms old; at most 40 ms"),
    "stamps of 0": (
        spoil(lambda topic, said: restamped(said, 0.0)),
        "comes without a time stamp",
    ),
    "stamps from the future": (stamped(-2.0), "2.00 s in the future"),
    "another frame": (in_frame("ECM"), "in the frame 'ECM'; the set-up says 'PSM1_base'"),
    "a jump": (jump, "its measured pose jumped by 20.0 mm"),
    "not a number": (not_a_number, "is not a number"),
    "a jaw that is no number": (
        jaw_of("jaw/measured_js", np.nan),
        "jaw/measured_js of PSM1 is nan, which is not an angle",
    ),
    "a jaw's set-point that is no number": (
        jaw_of("jaw/setpoint_js", np.nan),
        "jaw/setpoint_js of PSM1 is nan, which is not an angle",
    ),
    "a jaw without an angle": (
        jaw_of("jaw/setpoint_js"),
        "jaw/setpoint_js of PSM1 has 0 joints; a jaw has one angle",
    ),
}


@pytest.mark.parametrize("name", FAULTS)
def test_motion_ends_with_its_reason(driven: DrivenArm, name: str) -> None:
    begin, says = FAULTS[name]
    begin(driven)
    ends(driven)
    assert says in driven.drive.snapshot().stopped


def test_late_messages_end_motion_50_ms_after_the_last_one(driven: DrivenArm) -> None:
    for _ in range(5):
        driven.period(silent=True)
    assert not driven.period(silent=True).any()


def test_a_short_gap_only_delays(driven: DrivenArm) -> None:
    """Nothing is told of it, and nothing of the way is lost."""
    goal = driven.drive.snapshot().goal
    assert goal is not None
    for _ in range(8):
        driven.period(silent=True)
    assert driven.drive.snapshot().stopped == ""
    for _ in range(20):
        driven.period()
    assert driven.drive.snapshot().goal is not None
    reached = driven.transport.sent[-1][2] @ Pose(np.array([0.0, 0.0, 0.0286]))
    np.testing.assert_allclose(reached.position_m, goal.position_m, atol=1e-9)


def test_a_repeated_message_is_no_news(driven: DrivenArm) -> None:
    """Messages that arrive twice do no harm; that nothing newer comes does."""
    last: dict[str, Message] = {}
    driven.transport.spoil = lambda arm, topic, said: last.setdefault(topic, said)
    driven.period()
    assert driven.drive.arm.faults() == ()
    ends(driven)
    assert "ms old" in driven.drive.snapshot().stopped


def test_lost_messages_do_no_harm_while_others_come(driven: DrivenArm) -> None:
    rng = np.random.default_rng(1)
    driven.transport.spoil = lambda arm, topic, said: None if rng.random() < 0.3 else said
    for _ in range(20):
        driven.tick((0.0, 0.02, 0.0))
        for _ in range(5):
            driven.period()
        assert driven.drive.snapshot().stopped == ""


def test_a_second_client_is_found_by_the_echo(driven: DrivenArm) -> None:
    for _ in range(4):
        driven.arm.setpoint = driven.arm.setpoint.moved(np.array([0.0015, 0.0, 0.0]))
        driven.period()
    assert "is commanded by somebody else as well" in driven.drive.snapshot().stopped
    assert driven.arm.held == 1, "a hold ends the other's motion too"


def test_a_second_client_that_is_always_pulled_back_is_found(driven: DrivenArm) -> None:
    """Its goals are overwritten in every period, and refused once they are too far away."""
    for _ in range(4):
        driven.arm.setpoint = driven.arm.setpoint.moved(np.array([0.0002, 0.0, 0.0]))
        driven.period()
    assert "is commanded by somebody else as well" in driven.drive.snapshot().stopped


def test_a_second_client_that_is_overheard_stops_motion_at_once(driven: DrivenArm) -> None:
    driven.transport.intruder = "/teleoperation commands it as well (servo_cp)"
    ends(driven)
    assert "/teleoperation" in driven.drive.snapshot().stopped
    driven.transport.intruder = ""
    driven.go(2)
    assert driven.drive.snapshot().stopped == ""


def test_a_second_client_is_found_before_anything_is_sent() -> None:
    driven = DrivenArm()
    for _ in range(5):
        driven.arm.setpoint = driven.arm.setpoint.moved(np.array([0.0, 0.0, 0.0002]))
        driven.period()
    driven.go(2)
    assert driven.transport.sent == []
    assert "is moved by somebody else" in driven.drive.snapshot().stopped


def test_a_second_client_is_found_while_only_the_jaw_is_streamed() -> None:
    driven = DrivenArm()
    driven.tick(jaw_rad=0.5)
    driven.period()
    for _ in range(5):
        driven.arm.setpoint = driven.arm.setpoint.moved(np.array([0.0, 0.0, 0.0002]))
        driven.period()
    driven.tick((0.0, 0.02, 0.0), jaw_rad=0.5)
    driven.period()
    assert driven.transport.sent == []
    assert "is moved by somebody else" in driven.drive.snapshot().stopped
    assert driven.arm.held == 1, "a hold ends the other's motion too"


def test_an_arm_that_does_not_hear_is_found() -> None:
    driven = DrivenArm()
    driven.arm.deaf = True
    driven.go(12)
    assert "does not take up what it is sent" in driven.drive.snapshot().stopped


def test_after_a_trip_the_stream_starts_where_the_arm_stands(driven: DrivenArm) -> None:
    driven.arm.state = "PAUSED"
    driven.period()
    # By hand, while it is paused.
    driven.arm.setpoint = driven.arm.setpoint.moved(np.array([0.03, 0.0, 0.0]))
    for _ in range(60):
        driven.period()
    driven.arm.state = "ENABLED"
    driven.period()
    before_m = driven.arm.setpoint.position_m
    assert "PAUSED" in driven.drive.snapshot().stopped, "told once, though it is over"
    assert driven.drive.snapshot().stopped == ""
    driven.tick((0.0, 0.02, 0.0))
    driven.period()
    step_m = driven.transport.sent[-1][2].position_m - before_m
    assert np.linalg.norm(step_m) <= 0.0002


def test_a_trip_shorter_than_a_tick_is_told_before_anything_moves_again(
    driven: DrivenArm,
) -> None:
    driven.arm.state = "PAUSED"
    driven.period()
    driven.arm.state = "ENABLED"
    for _ in range(60):
        driven.period()
    driven.tick((0.0, 0.02, 0.0))
    assert not driven.period().any()
    assert "PAUSED" in driven.drive.snapshot().stopped
    driven.tick((0.0, 0.02, 0.0))
    driven.period()
    assert driven.period()[1] > 0.0


def test_an_executive_that_hangs_is_not_waited_for(driven: DrivenArm) -> None:
    way_m = sum(driven.period() for _ in range(40))
    assert way_m[1] <= 2.0 * 0.02 * 0.05
    assert not driven.period().any()


def test_the_jaw_of_an_executive_that_hangs_stops_as_well() -> None:
    driven = DrivenArm()
    driven.tick(jaw_rad=0.8)
    for _ in range(20):
        driven.period()
    reached_rad = driven.arm.jaw_setpoint_rad
    watched_s = driven.stream.watchdog_s + 2 * PERIOD_S
    assert 0.0 < reached_rad <= driven.stream.jaw_rad_s * watched_s
    for _ in range(20):
        driven.period()
    assert driven.arm.jaw_setpoint_rad == reached_rad
    driven.tick(jaw_rad=0.8)
    driven.period()
    assert driven.arm.jaw_setpoint_rad > reached_rad, "who commands again is heard again"


def test_nothing_is_sent_before_the_first_motion() -> None:
    driven = DrivenArm()
    for _ in range(5):
        driven.tick()
        for _ in range(5):
            driven.period()
    assert driven.transport.sent == []
    assert driven.transport.jaws == []


def test_a_jaw_goes_at_its_speed() -> None:
    driven = DrivenArm()
    driven.tick(jaw_rad=0.8)
    driven.period()
    assert driven.arm.jaw_setpoint_rad == pytest.approx(driven.stream.jaw_rad_s * PERIOD_S)
    for _ in range(12):
        driven.tick(jaw_rad=0.8)
        for _ in range(5):
            driven.period()
    assert driven.arm.jaw_setpoint_rad == pytest.approx(0.8)


@pytest.mark.parametrize("angles_rad", [(), (float("nan"),)])
def test_no_jaw_is_driven_from_where_nobody_knows(angles_rad: tuple[float, ...]) -> None:
    driven = DrivenArm()
    jaw_of("jaw/setpoint_js", *angles_rad)(driven)
    for _ in range(5):
        driven.tick(jaw_rad=0.8)
        for _ in range(5):
            driven.period()
    assert driven.transport.jaws == []
    assert "angle" in driven.drive.snapshot().stopped


def test_a_state_that_must_be_repeated_is_missed_when_it_is_not() -> None:
    driven = DrivenArm(limits=Limits(state_age_s=0.1))
    driven.go(2)
    driven.transport.spoil = lambda arm, topic, said: None if "state" in topic else said
    for _ in range(12):
        driven.period()
    assert "has not said for" in driven.drive.snapshot().stopped


def test_every_set_point_is_logged_with_the_time_it_was_taken_up(driven: DrivenArm) -> None:
    assert driven.log.took_up.count > 20
    # The toy takes a set-point up at once and tells so a period later.
    assert driven.log.took_up.quantile_s(0.99) == pytest.approx(PERIOD_S, abs=1e-3)
    assert driven.transport.sent[0][0] > BEGIN_S


def test_an_arm_stands_still_while_another_one_must_not_be_driven(driven: DrivenArm) -> None:
    transport, jaw_rad = driven.transport, driven.arm.jaw_setpoint_rad
    count = len(transport.sent)
    for _ in range(3):
        transport.clock_s += PERIOD_S
        transport.publish()
        driven.drive.period(transport.clock_s, PERIOD_S, "", others_stopped=True)
    held = [pose.position_m for _, _, pose in transport.sent[count - 1 :]]
    assert len(held) == 4
    assert np.ptp(held, axis=0) == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    assert driven.arm.jaw_setpoint_rad == jaw_rad
    driven.go(4)
    assert driven.period()[1] > 0.0
