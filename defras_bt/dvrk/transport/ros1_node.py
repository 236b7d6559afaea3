"""This process as a node of a ROS 1 master."""

from __future__ import annotations

import os
import socket
from typing import Any
from urllib.parse import urlparse
from xml.parsers.expat import ExpatError
from xmlrpc.client import Fault, ProtocolError, ServerProxy

from defras_bt.dvrk.ros_packages import ros_module
from defras_bt.dvrk.settings import Ros1Transport
from defras_bt.dvrk.transport.transport import ConnectionFailed

_ANSWER_S = 2.0


def join(settings: Ros1Transport, name: str) -> Any:
    """Join the master as a node and return ``rospy``; a process that has joined stays as it is.

    rospy itself would wait for ever for a master that is not there.

    Raises:
        RosMissing: ROS 1 is not installed.
        ConnectionFailed: no master answers, or the process belongs to another one.
    """
    rospy = ros_module("rospy")
    uri = settings.master_uri.rstrip("/")
    if rospy.core.is_initialized():
        if os.environ.get("ROS_MASTER_URI", "").rstrip("/") != uri:
            raise ConnectionFailed(
                f"this process has joined the ROS master {os.environ.get('ROS_MASTER_URI')} and "
                f"cannot join {uri} as well"
            )
        return rospy
    require_master(uri)
    os.environ["ROS_MASTER_URI"] = uri
    if settings.own_address is not None:
        os.environ["ROS_IP"] = settings.own_address
    rospy.init_node(name, anonymous=True, disable_signals=True, disable_rosout=True)
    return rospy


def require_master(uri: str) -> None:
    """See that a ROS 1 master answers.

    Raises:
        ConnectionFailed: none does.
    """
    host, port = address(uri)
    what = f"no ROS 1 master answers at {uri}"
    try:
        socket.create_connection((host, port), _ANSWER_S).close()
        answer: Any = ServerProxy(uri).getPid("/defras")
    except OSError as error:
        raise ConnectionFailed(
            f"{what} ({error}); start roscore there, or set transport.master_uri"
        ) from error
    except (Fault, ProtocolError, ExpatError) as error:
        raise ConnectionFailed(f"{what}, but something else ({error})") from error
    if answer[0] != 1:
        raise ConnectionFailed(f"{what}: it refused to say who it is ({answer})")


def node_lives(uri: str, node: str) -> bool:
    """Whether a node of the master at ``uri`` answers, or may live for all that is known here.

    Only a master that does not know it, or a computer that refuses the connection, tells that it is
    dead. A name that cannot be resolved or a time-out are of this computer's network.
    """
    try:
        found: Any = ServerProxy(uri).lookupNode("/defras", node)
        if found[0] != 1:
            return False
        socket.create_connection(address(found[2]), _ANSWER_S).close()
    except ConnectionRefusedError:
        return False
    except OSError:
        return True
    return True


def address(uri: str) -> tuple[str, int]:
    """Host and port of a master's address."""
    parts = urlparse(uri)
    return parts.hostname or "localhost", parts.port or 11311
