"""Scenes of the planning tests."""

from __future__ import annotations

import pytest

from defras_sim.scene import Scene

ROWS = ("####........", "####........", *(["............"] * 10))


def make_scene(columns: int = 5, rows: int = 5, margin_m: float = 0.01, **changes: object) -> Scene:
    return Scene.model_validate(
        {
            "name": "planning test",
            "attachments": {"map": ROWS},
            "roi": {"center_x_m": 0.02, "center_y_m": 0.0},
            "grasp": {"columns": columns, "rows": rows, "margin_m": margin_m},
            **changes,
        }
    )


@pytest.fixture(scope="session")
def scene() -> Scene:
    return make_scene()


@pytest.fixture(scope="session")
def crowded() -> Scene:
    """Twelve points 15 mm apart in x and 10 mm in y: the arms can be in each other's way."""
    return make_scene(columns=3, rows=4, margin_m=0.045)
