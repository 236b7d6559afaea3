"""A depth camera sees which way a tool went, by 2 mm, in spite of its pixels and its noise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from defras_bt.dvrk.checking.motion import Stroke, judged_by_camera
from defras_bt.dvrk.checking.seen_tool import SeenTool
from defras_sim.geometry import Floats
from defras_sim.resources import resource
from defras_sim.scene import Scene, load_scene

TIP_M = np.array([0.0, 0.06, 0.05])
RADIUS_M, LENGTH_M = 0.004, 0.1
PIXEL_M, NOISE_M = 0.001, 0.0005
SLANT = Rotation.from_rotvec([0.15, 0.1, 0.0])


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene(resource("sim/scenes/demo.yaml"))


class Seen:
    """Tissue, and a shaft whose lower end is the tip, on the pixels of a camera that looks along
    -x and down."""

    def __init__(self, scene: Scene) -> None:
        self.rng = np.random.default_rng(4)
        self.tip_m = TIP_M.copy()
        self.tool = SeenTool(scene, self.cloud_m)
        self.shaft = True

    def cloud_m(self) -> Floats:
        across, along = np.meshgrid(
            np.arange(-0.03, 0.03, PIXEL_M), np.arange(-0.01, 0.08, PIXEL_M), indexing="ij"
        )
        # Pixels stay where they are while the tool moves under them.
        y = TIP_M[1] + across.ravel()
        z = TIP_M[2] + along.ravel()
        axis = SLANT.apply([0.0, 0.0, 1.0])
        up = (z - self.tip_m[2]) / axis[2]
        middle_y, middle_x = self.tip_m[1] + up * axis[1], self.tip_m[0] + up * axis[0]
        beside = y - middle_y
        hit = (np.abs(beside) < RADIUS_M) & (up > 0.0) & (up < LENGTH_M)
        x = middle_x + np.sqrt(np.maximum(RADIUS_M**2 - beside**2, 0.0))
        shaft = np.column_stack([x, y, z])[hit]
        shaft[:, 0] += NOISE_M * self.rng.standard_normal(len(shaft))
        tissue = np.column_stack([self.rng.uniform(-0.06, 0.06, (3000, 2)), np.zeros(3000)])
        return np.vstack([tissue, shaft if self.shaft else shaft[:0]])


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_stroke_is_seen(scene: Scene, axis: int, sign: float) -> None:
    seen, stroke_m = Seen(scene), sign * 0.002 * np.eye(3)[axis]
    seen.tool.look(seen.tip_m)
    seen.tip_m = seen.tip_m + stroke_m
    moved_m = seen.tool.moved_m(seen.tip_m)
    assert moved_m is not None
    np.testing.assert_allclose(moved_m, stroke_m, atol=0.0008)
    assert judged_by_camera("PSM1", "x", Stroke(stroke_m, stroke_m, moved_m)).grade == "ok"


def test_a_camera_registered_the_other_way_round_is_found(scene: Scene) -> None:
    seen, commanded_m = Seen(scene), np.array([0.002, 0.0, 0.0])
    seen.tool.look(seen.tip_m)
    seen.tip_m = seen.tip_m + [0.0, 0.002, 0.0]
    moved_m = seen.tool.moved_m(seen.tip_m)
    found = judged_by_camera("PSM1", "x", Stroke(commanded_m, commanded_m, moved_m))
    assert found.grade == "wrong"
    assert "not registered to the same frame" in found.todo


def test_a_camera_that_does_not_see_the_tool_says_nothing(scene: Scene) -> None:
    seen = Seen(scene)
    seen.shaft = False
    seen.tool.look(seen.tip_m)
    assert seen.tool.moved_m(seen.tip_m) is None
