"""Keeping a native library's chatter out of our own output."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

STDOUT, STDERR = 1, 2


@contextmanager
def without_native_output(descriptor: int = STDOUT) -> Iterator[None]:
    """Whatever C code prints to ``descriptor`` meanwhile is dropped; exceptions pass through.

    PyBullet prints its build time to standard error when imported, and counts and names to standard
    output whenever it loads a body, which would spoil output that programs read.
    """
    (sys.stdout if descriptor == STDOUT else sys.stderr).flush()
    kept = os.dup(descriptor)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, descriptor)
        yield
    finally:
        os.dup2(kept, descriptor)
        os.close(kept)
        os.close(nowhere)
