"""What holds for all tests."""

from __future__ import annotations

from hypothesis import settings

# Machines are shared and noisy, so no example is timed; the same examples every time.
settings.register_profile("project", deadline=None, derandomize=True)
settings.load_profile("project")
