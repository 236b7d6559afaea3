"""Why a surface cannot become a scene."""

from __future__ import annotations


class RefusedSurface(ValueError):
    """A surface that cannot be used; the message says what is wrong and what would be valid."""
