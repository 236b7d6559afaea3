"""Message classes that are made here must be those of a built ``crtk_msgs``."""

from __future__ import annotations

import hashlib
from io import BytesIO

import pytest

from defras_bt.dvrk.ros_packages import RosMissing, ros_module
from defras_bt.dvrk.transport.crtk_messages import crtk_messages

HEADER_MD5 = "2176decaecbce78abc3b96ef049fabed"
"""Of std_msgs/Header, as every ROS 1 distribution has it."""


@pytest.fixture(autouse=True)
def _ros() -> None:
    try:
        ros_module("genpy.dynamic")
    except RosMissing as missing:
        pytest.skip(str(missing))


def test_checksums_are_those_of_the_definitions() -> None:
    # ROS 1 sums a definition with nested types replaced by their own sums.
    state = f"{HEADER_MD5} header\nstring state\nbool is_homed\nbool is_busy"
    string = f"{HEADER_MD5} header\nstring string"
    messages = crtk_messages()
    assert messages.OperatingState._md5sum == hashlib.md5(state.encode()).hexdigest()
    assert messages.StringStamped._md5sum == hashlib.md5(string.encode()).hexdigest()
    assert messages.OperatingState._type == "crtk_msgs/OperatingState"


def test_a_message_survives_the_wire() -> None:
    made = crtk_messages().OperatingState(state="PAUSED", is_homed=True)
    made.header.stamp.secs, made.header.frame_id = 7, "PSM1"
    wire = BytesIO()
    made.serialize(wire)
    back = crtk_messages().OperatingState().deserialize(wire.getvalue())
    assert (back.state, back.is_homed, back.is_busy) == ("PAUSED", True, False)
    assert (back.header.stamp.secs, back.header.frame_id) == (7, "PSM1")


def test_the_classes_are_made_once() -> None:
    assert crtk_messages() is crtk_messages()
