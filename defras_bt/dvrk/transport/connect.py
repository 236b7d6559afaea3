"""The transport that a set-up names."""

from __future__ import annotations

from defras_bt.dvrk.settings import Ros1Transport, Setup, SocketTransport
from defras_bt.dvrk.transport.ros1 import Ros1
from defras_bt.dvrk.transport.streamer_socket import StreamerSocket
from defras_bt.dvrk.transport.transport import Transport


def connect(setup: Setup, node: str = "defras") -> Transport:
    """Connect to the arms of ``setup``; ROS is loaded only where it is asked for.

    Raises:
        RosMissing: ROS is not installed.
        ConnectionFailed: nobody is there.
    """
    transport = setup.transport
    if isinstance(transport, Ros1Transport):
        return Ros1(transport, node)
    if isinstance(transport, SocketTransport):
        ports = {setup.arms[arm].name: port for arm, port in transport.ports.items()}
        return StreamerSocket(ports, transport.own_address)
    from defras_bt.dvrk.transport.ros2 import Ros2

    return Ros2(transport, node)
