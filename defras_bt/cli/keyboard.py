"""The operator's keyboard: one key an act where there is a terminal, one line an act elsewhere."""

from __future__ import annotations

import os
import select
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Thread
from typing import TextIO

from defras_bt.recording.operator_state import Act

KEYS = {
    "p": Act.PAUSE,
    "r": Act.RESUME,
    "s": Act.STOP,
    "t": Act.TAKE_OVER,
    "h": Act.HAND_BACK,
    "y": Act.APPROVE,
    "n": Act.REFUSE,
}
HELP = ", ".join(f"{key} {act.spoken}" for key, act in KEYS.items())

_LOOK_EVERY_S = 0.1


def act_of(typed: str) -> Act | None:
    """What was typed: a key, or an act in words ("take over", "take-over"); else None."""
    said = typed.strip().lower()
    named = {act.value: act for act in Act}
    return KEYS.get(said) or named.get(said.replace("-", "_").replace(" ", "_"))


@contextmanager
def listening(
    on_typed: Callable[[str], None], on_end: Callable[[], None], stream: TextIO | None = None
) -> Iterator[None]:
    """Call ``on_typed`` for every key (terminal) or line (anything else) until the block is left.

    ``on_end`` is called where the input ends before. Both are called from another thread.
    """
    source = stream if stream is not None else sys.stdin
    if source is None:
        # A program that was started without a standard input, as by cron, has none.
        on_end()
        yield
        return
    if not source.isatty():
        # A line may never come: the thread must not keep the program from ending.
        Thread(target=_lines, args=(source, on_typed, on_end), daemon=True).start()
        yield
        return
    with _single_keys(source.fileno()) as ended:
        reader = Thread(target=_keys, args=(source.fileno(), on_typed, on_end, ended), daemon=True)
        reader.start()
        try:
            yield
        finally:
            ended.append(True)
            reader.join()


def _lines(source: TextIO, on_typed: Callable[[str], None], on_end: Callable[[], None]) -> None:
    for line in source:
        if line.strip():
            on_typed(line)
    on_end()


def _keys(
    file: int, on_typed: Callable[[str], None], on_end: Callable[[], None], ended: list[bool]
) -> None:
    while not ended:
        if select.select([file], [], [], _LOOK_EVERY_S)[0]:
            typed = os.read(file, 1)
            if not typed:
                on_end()
                return
            on_typed(typed.decode(errors="replace"))


@contextmanager
def _single_keys(file: int) -> Iterator[list[bool]]:
    """Keys come one by one and unseen; Ctrl-C still interrupts. As it was, afterwards."""
    import termios
    import tty

    before = termios.tcgetattr(file)
    tty.setcbreak(file)
    try:
        yield []
    finally:
        termios.tcsetattr(file, termios.TCSADRAIN, before)
