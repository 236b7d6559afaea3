"""A file that a library may write to and whose disk may be full without the library noticing.

A library that writes in a thread of its own can hang for ever once that thread fails: rerun's file
sink does (0.41), at its start, at a flush, or at the end of the process. So it writes into a pipe,
and what comes out of the pipe is written here, where a failure is an exception like any other.
"""

from __future__ import annotations

import os
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Thread

_BLOCK = 1 << 16
_CLOSING_S = 30.0


class Drain:
    """Copies whatever is written to :attr:`inlet` into ``path``, as it comes.

    Once writing fails the rest is thrown away, so that whoever writes never waits; :meth:`check`
    tells of it.

    Raises:
        OSError: ``path`` cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self._error: OSError | None = None
        self._file = path.open("wb", buffering=0)
        self._folder = TemporaryDirectory(prefix="defras_drain_")
        self.inlet = Path(self._folder.name) / path.name
        os.mkfifo(self.inlet)
        self._thread = Thread(target=self._copy, name=f"drain of {path.name}", daemon=True)
        self._thread.start()

    def check(self) -> None:
        """Raise what writing raised.

        Raises:
            OSError: the disk is full, or the file cannot be written for another reason.
        """
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        """Wait for the rest, once whoever wrote to the inlet has closed it.

        Raises:
            OSError: as :meth:`check`, or what was written does not come to an end.
        """
        self._thread.join(_CLOSING_S)
        if self._thread.is_alive():
            raise TimeoutError(f"{self.inlet.name} was not closed within {_CLOSING_S:g} s")
        self._folder.cleanup()
        self.check()

    def _copy(self) -> None:
        with self._file, self.inlet.open("rb", buffering=0) as source:
            while block := source.read(_BLOCK):
                if self._error is None:
                    self._write(block)

    def _write(self, block: bytes) -> None:
        try:
            left = memoryview(block)
            while left:
                left = left[self._file.write(left) :]
        except OSError as error:
            self._error = error
