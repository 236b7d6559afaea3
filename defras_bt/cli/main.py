"""The command line: ``defras``."""

from __future__ import annotations

import signal


def main() -> None:
    """Load all commands and run the one asked for."""
    # Loading takes seconds. Ctrl-C ends the program meanwhile as the system does it: without a
    # traceback. Where interrupts are ignored, as in the background of a script, they stay so.
    interruptible = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if interruptible:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from defras_bt.cli.app import run_commands

    if interruptible:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    run_commands()
