"""One synthetic run for all tests of what a run leaves."""

from __future__ import annotations

import pytest

from tests.recording.synthetic_run import SyntheticRun


@pytest.fixture(scope="session")
def short_run() -> SyntheticRun:
    """Without pictures and on a coarse grid: fast to record."""
    return SyntheticRun(with_images=False, grid=9)


@pytest.fixture(scope="session")
def rich_run() -> SyntheticRun:
    """With everything a world can give."""
    return SyntheticRun(grid=9)
