"""A pull on tissue, seen by a camera, with something wrong; its truth has a mesh of its own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from defras_bt.learning.estimate import Keyframe
from defras_sim.camera.depth import depth_cloud_m
from defras_sim.camera.ray_caster import RayCaster
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Attachments, Roi, Scene
from defras_sim.tissue.model import TissueModel

GRASP = Pose(np.array([0.05, 0.0, 0.0]))
WAY_M = np.array([-0.3, 0.0, 1.0]) * 0.024
FRAMES = 5

FRAME = ("##########..",) * 2 + ("##..........",) * 8 + ("##########..",) * 2
PATCH = tuple(
    row[:5] + "###" + row[8:] if 5 <= number < 8 else row for number, row in enumerate(FRAME)
)
"""Three sides, and a patch between them and the grasp."""


def held_scene(rows: Sequence[str] = FRAME) -> Scene:
    return Scene(
        name="pull",
        attachments=Attachments(map=tuple(rows)),
        roi=Roi(center_x_m=0.02, center_y_m=-0.02),
    )


def observed(
    actual: Scene,
    *,
    grasp: Pose = GRASP,
    slips_m: Sequence[Floats] = (np.zeros(3),) * FRAMES,
    camera_moved: Sequence[Pose] = (Pose(np.zeros(3)),) * FRAMES,
    seed: int = 1,
) -> list[Keyframe]:
    """Frames of a slanted pull, taken at ``grasp`` instead of where the arm believes.

    What is held is ``slips_m`` (3,) off the tip in each frame; ``camera_moved`` moves the clouds.
    """
    rng = np.random.default_rng(seed)
    model = TissueModel(actual, elements_xyz=(10, 10, 1))
    model.grasp("psm1", grasp)
    frames = []
    for number in range(FRAMES):
        tip = GRASP.moved(WAY_M * (number + 1) / FRAMES)
        surface = model.solve({"psm1": tip.moved(slips_m[number])}).surface
        cloud_m = depth_cloud_m(actual.depth_camera, surface, RayCaster(surface), rng)
        cloud_m = camera_moved[number].apply(cloud_m)
        frames.append(Keyframe(float(number), {"psm1": GRASP}, {"psm1": tip}, cloud_m))
    return frames
