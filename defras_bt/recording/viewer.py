"""Look at a timeline: in rerun's viewer, or as a picture where there is no screen."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, TypeVar

from rerun.experimental import ViewerClient

TIMELINE = "run.rrd"
T = TypeVar("T")
_NOTICES_S = 6.0
_PATIENCE_S = 40.0
_PAUSE_S = 0.25
_VULKAN_HELP = (
    "the viewer needs Vulkan, which was not found; without a graphics card a software version "
    "does: apt-get install mesa-vulkan-drivers libvulkan1"
)


class ViewerMissing(RuntimeError):
    """The viewer cannot run here or gave no picture; says why and what helps."""


def timeline_of(run: Path) -> Path:
    """The timeline in a run's folder, or ``run`` itself if it is an .rrd file.

    Raises:
        FileNotFoundError: there is none.
    """
    file = run / TIMELINE if run.is_dir() else run
    if not file.is_file():
        raise FileNotFoundError(
            f"{file} does not exist; give a folder that defras run --out wrote, or its run.rrd"
        )
    return file


def view(run: Path) -> int:
    """Open a run's timeline in the viewer; returns the viewer's exit code when it is closed."""
    return subprocess.run(viewer_command(timeline_of(run)), check=False).returncode


def viewer_command(timeline: Path, *options: str) -> list[str]:
    """How the viewer is started on a file.

    It always opens a server, by default to the whole network; a run may show a patient, so only
    programs of this machine can reach it.
    """
    return [sys.executable, "-m", "rerun", str(timeline), "--bind", "127.0.0.1", *options]


@contextmanager
def viewer_process(
    command: list[str], output: IO[bytes] | int
) -> Iterator[subprocess.Popen[bytes]]:
    """A viewer that ends with the block, together with the program that it starts for itself."""
    viewer = subprocess.Popen(
        command,
        # CI keeps the viewer from asking about analytics.
        env={**os.environ, "CI": "1"},
        stdout=output,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    )
    try:
        yield viewer
    finally:
        with suppress(ProcessLookupError):  # it ended by itself
            os.killpg(viewer.pid, signal.SIGTERM)
        viewer.wait()


def screenshot(
    run: Path, picture: Path, at_s: float | None = None, size_px: tuple[int, int] = (1600, 1000)
) -> None:
    """Write a PNG of the whole viewer at world time ``at_s`` (None: the end), without a screen.

    Raises:
        ViewerMissing: no picture came; usually Vulkan is missing.
    """
    timeline = timeline_of(run)
    port = _free_port()
    window = ("--window-size", f"{size_px[0]}x{size_px[1]}")
    command = viewer_command(timeline, "--headless", "--port", str(port), *window)
    with TemporaryFile() as said, viewer_process(command, said) as viewer:
        try:
            picture.write_bytes(_picture(viewer, port, at_s))
        except (TimeoutError, RuntimeError, ConnectionError) as error:
            said.seek(0)
            text = said.read().decode(errors="replace").strip()
            reason = _VULKAN_HELP if "adapter" in text.lower() else str(error)
            raise ViewerMissing(f"no picture of {timeline}: {reason}\n{text}") from error


def _picture(viewer: subprocess.Popen[bytes], port: int, at_s: float | None) -> bytes:
    client = _patiently(viewer, lambda: _connect(port), "the viewer did not answer")
    _patiently(viewer, lambda: _loaded(client), "the recording was not loaded")
    if at_s is None:
        client.set_time("sim_time", play_state="following")
    else:
        client.set_time("sim_time", duration=at_s, play_state="paused")
    # Views fill in one by one, and the viewer's own notices fade out.
    time.sleep(_NOTICES_S)
    last = [b""]
    return _patiently(viewer, lambda: _settled(client, last), "the picture did not settle")


def _connect(port: int) -> ViewerClient | None:
    try:
        return ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
    except (ConnectionError, RuntimeError):
        return None


def _loaded(client: ViewerClient) -> bool:
    state = client.get_state()
    return bool(state.active_recording and state.views and not state.loading)


def _settled(client: ViewerClient, last: list[bytes]) -> bytes | None:
    now = client.take_screenshot()
    same = now == last[0]
    last[0] = now
    return now if same else None


def _patiently(viewer: subprocess.Popen[bytes], ask: Callable[[], T | None], late: str) -> T:
    """Ask until the answer is true; the viewer must live meanwhile."""
    for _ in range(round(_PATIENCE_S / _PAUSE_S)):
        if viewer.poll() is not None:
            raise RuntimeError(f"the viewer ended with exit code {viewer.returncode}")
        answer = ask()
        if answer:
            return answer
        time.sleep(_PAUSE_S)
    raise TimeoutError(f"{late} within {_PATIENCE_S:.0f} s")


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port
