"""What holds for all tests."""

from __future__ import annotations

import signal

from hypothesis import settings

# Machines are shared and noisy, so no example is timed; the same examples every time.
settings.register_profile("project", deadline=None, derandomize=True)
settings.load_profile("project")


def pytest_configure() -> None:
    """Tests and the programs that they start heed interrupts, even where whoever started the tests
    had them ignored (a shell's ``&``, ``nohup``)."""
    for number, default in (
        (signal.SIGINT, signal.default_int_handler),
        (signal.SIGHUP, signal.SIG_DFL),
    ):
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, default)
