"""What a timeline holds already, so that only changes are written; colours as rerun wants them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


class Changes:
    """Remembers one value per key."""

    def __init__(self) -> None:
        self._last: dict[str, object] = {}

    def new(self, key: str, value: object) -> bool:
        """True if ``value`` is not what this key had before; it is then."""
        if key in self._last and self._last[key] == value:
            return False
        self._last[key] = value
        return True


def packed(colours: object) -> NDArray[np.uint32]:
    """Packed colours: rerun cannot take four plain integers for four colours."""
    rgb = np.asarray(colours, np.uint32).reshape(-1, 3)
    return (rgb @ np.array([1 << 24, 1 << 16, 1 << 8], np.uint32) + 255).astype(np.uint32)
