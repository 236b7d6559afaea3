"""Only sound and newer messages count."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.dvrk.crtk.arm import CrtkArm, NotFresh
from defras_bt.dvrk.crtk.newest import Newest
from defras_bt.dvrk.transport.messages import PoseMessage, StateMessage
from defras_sim.geometry import Pose
from tests.dvrk.toy_robot import BEGIN_S, ToyTransport, toy_setup


class Clock:
    """Shows what the test sets."""

    def __init__(self) -> None:
        self.now_s = 50.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def newest(clock: Clock) -> Newest[PoseMessage]:
    return Newest("measured_cp of PSM1", clock, "base")


def said(stamp_s: float, frame: str = "base") -> PoseMessage:
    return PoseMessage(stamp_s, frame, Pose(np.array([stamp_s, 0.0, 0.0])))


def test_a_newer_message_is_taken(newest: Newest[PoseMessage], clock: Clock) -> None:
    assert newest.age_s() == float("inf")
    assert newest.offer(said(49.9))
    assert newest.offer(said(49.95))
    assert newest.age_s() == pytest.approx(0.05)
    clock.now_s = 51.0
    assert newest.age_s() == pytest.approx(1.05)


def test_the_same_once_more_is_no_news_and_no_fault(newest: Newest[PoseMessage]) -> None:
    newest.offer(said(49.9))
    assert not newest.offer(said(49.9))
    assert (newest.repeated, newest.refused, newest.fault) == (1, 0, "")


@pytest.mark.parametrize(
    ("bad", "says"),
    [
        (said(0.0), "without a time stamp"),
        (said(float("nan")), "without a time stamp"),
        (said(49.5), "0.400 s before the one before it"),
        (said(50.2), "0.20 s in the future"),
        (said(49.95, "ECM"), "in the frame 'ECM'; the set-up says 'base'"),
    ],
)
def test_what_is_refused_leaves_the_last_sound_one(
    newest: Newest[PoseMessage], bad: PoseMessage, says: str
) -> None:
    newest.offer(said(49.9))
    assert not newest.offer(bad)
    assert says in newest.fault
    assert newest.message is not None
    assert newest.message.stamp_s == 49.9
    newest.offer(said(49.96))
    assert newest.fault == "", "a sound one ends it"


def test_of_several_the_one_of_a_moment(newest: Newest[PoseMessage]) -> None:
    assert newest.at(49.0) is None
    for stamp_s in (49.90, 49.91, 49.92, 49.93):
        newest.offer(said(stamp_s))
    found = newest.at(49.914)
    assert found is not None
    assert found.stamp_s == 49.91


class TestArm:
    """Getters, and what busy means."""

    @pytest.fixture
    def transport(self) -> ToyTransport:
        return ToyTransport("PSM1")

    @pytest.fixture
    def arm(self, transport: ToyTransport) -> CrtkArm:
        return CrtkArm(toy_setup().arms["psm1"], transport)

    def test_before_anything_came(self, arm: CrtkArm) -> None:
        for get in (arm.pose, arm.setpoint_pose, arm.joints, arm.jaw_rad, arm.state):
            with pytest.raises(NotFresh, match="PSM1"):
                get()

    def test_fresh_readings_with_stamp_and_age(self, arm: CrtkArm, transport: ToyTransport) -> None:
        transport.publish()
        transport.clock_s += 0.03
        pose = arm.pose()
        assert (pose.stamp_s, pose.age_s) == (BEGIN_S, pytest.approx(0.03))
        assert arm.jaw_rad().value == 0.0
        assert arm.joints().value.shape == (6,)

    def test_old_readings_raise(self, arm: CrtkArm, transport: ToyTransport) -> None:
        transport.publish()
        transport.clock_s += 0.2
        with pytest.raises(NotFresh, match=r"is 0\.200 s old; at most 0\.1 s"):
            arm.pose()
        assert arm.state().state == "ENABLED", "many drivers tell it only when it changes"

    def test_busy_until_a_strictly_newer_state_says_otherwise(
        self, arm: CrtkArm, transport: ToyTransport
    ) -> None:
        assert arm.is_busy(BEGIN_S), "nothing was heard"
        transport.publish()
        assert arm.is_busy(BEGIN_S), "a state of that very moment tells nothing of what followed"
        transport.clock_s += 0.01
        transport.publish()
        assert not arm.is_busy(BEGIN_S)
        arm.operating_state.offer(StateMessage(BEGIN_S + 0.02, "ENABLED", True, True))
        assert arm.is_busy(BEGIN_S)
