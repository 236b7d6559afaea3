from __future__ import annotations

import pytest

from defras_sim.resources import resource
from defras_sim.scene import Scene, load_scene


@pytest.fixture
def demo_like_scene() -> Scene:
    return load_scene(resource("sim/scenes/demo.yaml"))
