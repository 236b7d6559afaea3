"""Knows at once when the program at the other end of a TCP port has ended."""

from __future__ import annotations

import socket


class Lifeline:
    """A connection over which nothing is ever said.

    The system closes it when the other program ends, however it ends: that is known with the next
    look, where asking again and again would be known later and cost more.
    """

    def __init__(self, host: str, port: int, time_out_s: float = 2.0) -> None:
        """
        Raises:
            OSError: nobody listens there.
        """
        self._socket = socket.create_connection((host, port), time_out_s)
        self._socket.setblocking(False)
        self._cut = False

    @property
    def cut(self) -> bool:
        """Whether the other end is gone; never waits."""
        if not self._cut:
            try:
                self._cut = self._socket.recv(1) == b""
            except BlockingIOError:
                return False
            except OSError:
                self._cut = True
        return self._cut

    def close(self) -> None:
        self._socket.close()
        self._cut = True
