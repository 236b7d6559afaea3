"""A laboratory for each test."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.hidden_effect.hidden_retractions import Laboratory


@pytest.fixture
def laboratory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Laboratory:
    return Laboratory(tmp_path, monkeypatch)
