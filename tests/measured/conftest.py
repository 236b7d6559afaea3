"""Measurements of others, which are no part of the project: found beside it, or told where."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

_PLACE = "DEFRAS_DATA"


@pytest.fixture(scope="session")
def measured_data() -> Path:
    """Folder of the measured data; tests that need it are skipped where it is not."""
    told = os.environ.get(_PLACE)
    folder = Path(told) if told else Path(__file__).parents[3] / "shared" / "data"
    if not (folder / "arm_cable").is_dir():
        pytest.skip(
            f"no measured data in {folder}: put the folder there or name it in {_PLACE} "
            "(its README lists the sources)"
        )
    return folder
