"""A fresh bench for every test of a node."""

from __future__ import annotations

import pytest

from tests.nodes.bench import Bench


@pytest.fixture
def bench() -> Bench:
    return Bench()
