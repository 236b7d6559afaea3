"""Joining a ROS 1 master as a part of the stand-in."""

from __future__ import annotations

from typing import Any
from urllib.parse import urlparse

from defras_bt.dvrk.ros_packages import ros_module
from defras_bt.dvrk.settings import Ros1Transport
from defras_bt.dvrk.transport import ros1_node

_LOOPBACK = ("localhost", "127.0.0.1")


def join(uri: str, name: str, *, simulated_clock: bool) -> Any:
    """Become a node of the master at ``uri``, whose clock this decides on; returns ``rospy``.

    On a master of this machine everything stays on the loopback. A process can join only once.

    Raises:
        ConnectionFailed: no master answers.
        RosMissing: ROS 1 is not installed.
    """
    ros1_node.require_master(uri)
    master = ros_module("rosgraph").Master(f"/{name}", master_uri=uri)
    master.setParam("/use_sim_time", simulated_clock)
    address = "127.0.0.1" if urlparse(uri).hostname in _LOOPBACK else None
    return ros1_node.join(Ros1Transport(master_uri=uri, own_address=address), name)
