"""History: rows of numbers with the times at which they came."""

from __future__ import annotations

import numpy as np

from defras_sim.geometry import Floats


class History:
    """Rows of ``columns`` numbers, in order of time; grows without copying each time."""

    def __init__(self, columns: int) -> None:
        self._time_s = np.zeros(64)
        self._values = np.zeros((64, columns))
        self._count = 0

    def __len__(self) -> int:
        return self._count

    @property
    def time_s(self) -> Floats:
        """World time (n,) of each row; not to be kept, as rows may be replaced."""
        return self._time_s[: self._count]

    @property
    def values(self) -> Floats:
        """All rows (n, columns); not to be kept, as rows may be replaced."""
        return self._values[: self._count]

    def add(self, time_s: float, row: Floats) -> None:
        """Add ``row`` (columns,); rows at ``time_s`` or later give way to it."""
        self._count = int(np.searchsorted(self.time_s, time_s))
        if self._count == len(self._time_s):
            self._time_s = np.concatenate([self._time_s, np.zeros_like(self._time_s)])
            self._values = np.concatenate([self._values, np.zeros_like(self._values)])
        self._time_s[self._count] = time_s
        self._values[self._count] = row
        self._count += 1
