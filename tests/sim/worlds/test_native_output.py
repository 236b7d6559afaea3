"""Chatter of native libraries is dropped, whichever stream it goes to."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from defras_sim.worlds.native_output import STDERR, STDOUT, without_native_output


@pytest.mark.parametrize("descriptor", [STDOUT, STDERR])
def test_only_the_named_stream_is_dropped(
    descriptor: int, capfd: pytest.CaptureFixture[str]
) -> None:
    with without_native_output(descriptor):
        os.write(STDOUT, b"out")
        os.write(STDERR, b"err")
    os.write(descriptor, b" after")
    expected = (" after", "err") if descriptor == STDOUT else ("out", " after")
    assert tuple(capfd.readouterr()) == expected


@pytest.mark.parametrize(
    ("module", "loaded"),
    [("defras_bt.executive.operation", False), ("defras_sim.worlds.bullet_world", True)],
)
def test_pybullet_loads_silently_and_only_when_needed(module: str, loaded: bool) -> None:
    code = f"import sys, {module}; print('pybullet' in sys.modules)"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert (ended.stdout.strip(), ended.stderr) == (str(loaded), "")
