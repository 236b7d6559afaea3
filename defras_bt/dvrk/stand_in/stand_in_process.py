"""The stand-in as a process of its own, for tests and benchmarks."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from time import monotonic, sleep
from types import TracebackType

from defras_bt.dvrk.stand_in.ros_master import RosMaster

READY = "Standing in for a dVRK"
"""What it says when arms and patient are there."""

_READY_S = 180.0
_ENDS_S = 10.0
_CALL = "import sys; from defras_bt.cli.main import main; sys.exit(main())"


class StandInFailed(RuntimeError):
    """The stand-in did not come up; the message is what it said."""


class StandInProcess:
    """``defras dvrk simulate`` with ``arguments`` at a master, from ``with`` to its end."""

    def __init__(self, master: RosMaster, arguments: Sequence[str], log: Path) -> None:
        self._master, self._arguments, self._log = master, tuple(arguments), log
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> StandInProcess:
        """
        Raises:
            StandInFailed: it does not come up.
        """
        command = [sys.executable, "-c", _CALL, "dvrk", "simulate", *self._arguments]
        with self._log.open("wb") as log:
            self._process = subprocess.Popen(
                [*command, "--master", self._master.uri],
                # The arms have a period to keep: no library may take all cores beside them.
                env={**self._master.environment, "OMP_NUM_THREADS": "1", "PYTHONUNBUFFERED": "1"},
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                # Its patient is a child of its own: all of them end together.
                start_new_session=True,
            )
        since_s = monotonic()
        while READY not in self.said():
            if self._process.poll() is not None or monotonic() - since_s > _READY_S:
                self.kill()
                raise StandInFailed(self.said()[-2000:] or "the stand-in said nothing")
            sleep(0.05)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.end()

    def said(self) -> str:
        """Everything it has said."""
        return self._log.read_text(errors="replace")

    def end(self) -> int | None:
        """Have it end as with Ctrl-C; its exit code."""
        if self._process is None:
            return None
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
            try:
                self._process.wait(_ENDS_S)
            except subprocess.TimeoutExpired:
                self.kill()
        return self._process.returncode

    def kill(self) -> None:
        """End arms, patient and cameras at once."""
        if self._process is not None and self._process.poll() is None:
            os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()
