"""A ROS 1 master of one's own: roscore on a free port of the loopback."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
from contextlib import suppress
from pathlib import Path
from time import monotonic, sleep
from types import TracebackType
from typing import Any
from xmlrpc.client import ServerProxy

from defras_bt.dvrk.ros_packages import INSTALL_LINE, RosMissing

_READY_S = 20.0
_ENDS_S = 5.0
_LOOPBACK = "127.0.0.1"


class RosMaster:
    """Runs from ``with`` to its end; what it logs goes into ``folder``."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._process: subprocess.Popen[bytes] | None = None
        self._master_pid: int | None = None
        self.port = 0

    @property
    def uri(self) -> str:
        return f"http://{_LOOPBACK}:{self.port}"

    @property
    def environment(self) -> dict[str, str]:
        """The environment of processes that are to join it."""
        logs = str(self._folder / "log")
        return {
            **os.environ,
            "ROS_MASTER_URI": self.uri,
            "ROS_IP": _LOOPBACK,
            "ROS_HOME": str(self._folder),
            "ROS_LOG_DIR": logs,
        }

    def __enter__(self) -> RosMaster:
        """
        Raises:
            RosMissing: there is no roscore.
            RuntimeError: it does not come up.
        """
        program = shutil.which("roscore") or shutil.which("roscore", path="/opt/ros/noetic/bin")
        if program is None:
            raise RosMissing(f"there is no roscore. On Debian 12: {INSTALL_LINE}")
        self._folder.mkdir(parents=True, exist_ok=True)
        self.port = free_port()
        with (self._folder / "roscore.log").open("wb") as log:
            self._process = subprocess.Popen(
                [program, "-p", str(self.port)],
                env=self.environment,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
            )
        try:
            self._master_pid = self._wait_for_answer()
        except RuntimeError:
            self.kill()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.kill()

    def kill(self) -> None:
        """End it at once, as a computer that loses power does."""
        process, self._process = self._process, None
        if process is None:
            return
        # The master is a child of roscore's in a session of its own.
        if self._master_pid is not None:
            with suppress(ProcessLookupError):
                os.kill(self._master_pid, signal.SIGKILL)
        process.terminate()
        try:
            process.wait(_ENDS_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def _wait_for_answer(self) -> int:
        """The process id of the master, once it answers."""
        since_s = monotonic()
        while monotonic() - since_s < _READY_S:
            if self._process is None or self._process.poll() is not None:
                break
            try:
                answer: Any = ServerProxy(self.uri).getPid("/defras")
                return int(answer[2])
            except OSError:
                sleep(0.1)
        told = (self._folder / "roscore.log").read_text(errors="replace")[-500:]
        raise RuntimeError(f"roscore on port {self.port} did not come up: {told}")


def free_port() -> int:
    """A port of the loopback that nobody listens on."""
    with socket.socket() as probe:
        probe.bind((_LOOPBACK, 0))
        return int(probe.getsockname()[1])
