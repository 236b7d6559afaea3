"""Scenes of the planning tests."""

from __future__ import annotations

import numpy as np
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


def same_outcomes(one, other) -> bool:
    """Whether executions agree as well as rehearsals converge.

    The number of threads changes the order of sums; a way through a snap then ends elsewhere within
    the solver's tolerance, which for rehearsals is a few thousandths of the force.
    """
    return len(one) == len(other) and all(
        (a.point, a.manoeuvres, a.finished) == (b.point, b.manoeuvres, b.finished)
        and np.isclose(a.visibility, b.visibility, rtol=0, atol=0.03)
        and np.isclose(a.force_max_n, b.force_max_n, rtol=1e-2, atol=1e-3)
        for a, b in zip(one, other, strict=True)
    )
