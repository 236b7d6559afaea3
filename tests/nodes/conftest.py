"""A fresh bench for every test of a node."""

from __future__ import annotations

import pytest

from defras_bt.executive.testing import NodeBench


@pytest.fixture
def bench() -> NodeBench:
    return NodeBench()
