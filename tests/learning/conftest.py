"""One synthetic retraction, observed; its truth has a mesh that no estimator uses."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from defras_bt.learning.estimate import Keyframe
from defras_sim.camera.depth import depth_cloud_m
from defras_sim.camera.ray_caster import RayCaster
from defras_sim.geometry import Pose
from defras_sim.scene import Attachments, Roi, Scene
from defras_sim.tissue.model import TissueModel

# A set-up without wrinkles: meshes of 8x8x1 and 10x10x1 agree within about a millimetre.
GRASP = Pose(np.array([0.05, 0.0, 0.0]))
LIFTS_M = (0.0, 0.005, 0.010, 0.015, 0.020)

FRAME = ("##########..",) * 2 + ("##..........",) * 8 + ("##########..",) * 2


def _with_patch(rows: tuple[str, ...], row: int, column: int, size: int = 3) -> tuple[str, ...]:
    """``rows`` with a square patch whose upper left corner is at ``row``, ``column``."""
    marks = [list(line) for line in rows]
    for i in range(row, row + size):
        marks[i][column : column + size] = "#" * size
    return tuple("".join(line) for line in marks)


TRUE_MAP = _with_patch(FRAME, 5, 5)
"""Three sides, and a patch between them and the grasp."""


def _scene(rows: tuple[str, ...]) -> Scene:
    roi = Roi(center_x_m=0.02, center_y_m=-0.02)
    return Scene(name="learning", attachments=Attachments(map=rows), roi=roi)


@pytest.fixture(scope="session")
def truth() -> Scene:
    return _scene(TRUE_MAP)


@pytest.fixture(scope="session")
def belief_without_patch() -> Scene:
    return _scene(FRAME)


@pytest.fixture(scope="session")
def belief_with_another_patch() -> Scene:
    return _scene(_with_patch(TRUE_MAP, 2, 7))


Record = Callable[[int], list[Keyframe]]


@pytest.fixture(scope="session")
def record(truth: Scene) -> Record:
    """Frames of a pull on the true tissue, with the camera's noise of a seed."""
    model = TissueModel(truth, elements_xyz=(10, 10, 1))
    model.grasp("psm1", GRASP)
    tips = [GRASP.moved(np.array([0.0, 0.0, lift])) for lift in LIFTS_M]
    surfaces = [model.solve({"psm1": tip}).surface for tip in tips]

    def observed(seed: int) -> list[Keyframe]:
        rng = np.random.default_rng(seed)
        return [
            Keyframe(
                float(number),
                {"psm1": GRASP},
                {"psm1": tip},
                depth_cloud_m(truth.depth_camera, surface, RayCaster(surface), rng),
            )
            for number, (tip, surface) in enumerate(zip(tips, surfaces, strict=True))
        ]

    return observed
