"""The two message types of ``crtk_msgs``, made from their definitions.

Debian packages ROS 1 without ``crtk_msgs``. What two ROS nodes compare when they connect is the
checksum of a definition's text, so classes made here speak with those of a built ``crtk_msgs``.

Definitions: github.com/collaborative-robotics/crtk_msgs, ``msg/OperatingState.msg`` and
``msg/StringStamped.msg``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

from defras_bt.dvrk.ros_packages import ros_module

_HEADER = f"""
{"=" * 80}
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
"""
OPERATING_STATE = f"""Header header
string state
bool is_homed
bool is_busy
{_HEADER}"""
STRING_STAMPED = f"""Header header
string string
{_HEADER}"""


@dataclass(frozen=True)
class CrtkMessages:
    """The classes: ``OperatingState`` {header, state, is_homed, is_busy}, ``StringStamped``
    {header, string}."""

    OperatingState: Any
    StringStamped: Any


@cache
def crtk_messages() -> CrtkMessages:
    """The message classes; the same ones at every call.

    Raises:
        RosMissing: ROS 1 is not installed.
    """
    generate_dynamic = ros_module("genpy.dynamic").generate_dynamic

    def made(name: str, text: str) -> Any:
        return generate_dynamic(name, text)[name]

    return CrtkMessages(
        made("crtk_msgs/OperatingState", OPERATING_STATE),
        made("crtk_msgs/StringStamped", STRING_STAMPED),
    )
