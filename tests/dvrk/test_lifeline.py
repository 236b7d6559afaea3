"""The end of another program is known with the next look."""

from __future__ import annotations

import socket

import pytest

from defras_bt.dvrk.transport.lifeline import Lifeline


def test_it_is_cut_when_the_other_end_goes() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        lifeline = Lifeline(*server.getsockname())
        other, _ = server.accept()
    assert not lifeline.cut
    other.close()
    lifeline_end = [lifeline.cut for _ in range(200)]
    assert lifeline_end[-1]
    lifeline.close()
    assert lifeline.cut


def test_nobody_there() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = server.getsockname()
    with pytest.raises(OSError, match="refused"):
        Lifeline(*address)
