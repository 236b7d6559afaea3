"""Joining a ROS 1 master from this process."""

from __future__ import annotations

import os
import socket
from typing import Any
from urllib.parse import urlparse

from defras_bt.dvrk.ros_packages import ros_module

_LOOPBACK = ("localhost", "127.0.0.1")


class NoMaster(RuntimeError):
    """No ROS master answers; the message says where, and how to start one."""


def require_master(uri: str, within_s: float = 2.0) -> None:
    """See that a ROS master answers at ``uri``.

    Raises:
        NoMaster: none does.
    """
    parts = urlparse(uri)
    try:
        socket.create_connection((parts.hostname or "", parts.port or 11311), within_s).close()
    except OSError as error:
        raise NoMaster(
            f"no ROS master answers at {uri} ({error}); start one: roscore -p {parts.port or 11311}"
        ) from error


def join(uri: str, name: str, *, simulated_clock: bool) -> Any:
    """Become the node ``name`` of the master at ``uri``; returns the module ``rospy``.

    On a master of this machine everything stays on the loopback. A process can join only once.

    Raises:
        NoMaster: no master answers.
        RosMissing: ROS 1 is not installed.
    """
    require_master(uri)
    os.environ["ROS_MASTER_URI"] = uri
    if urlparse(uri).hostname in _LOOPBACK:
        os.environ.setdefault("ROS_IP", "127.0.0.1")
    rospy = ros_module("rospy")
    master = ros_module("rosgraph").Master(f"/{name}", master_uri=uri)
    master.setParam("/use_sim_time", simulated_clock)
    rospy.init_node(name, disable_signals=True, log_level=rospy.WARN)
    return rospy
