"""What can be shown of a diagnosed retraction: clouds beside the plain and the extended tissue."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from defras_bt.diagnosis.diagnosis import Diagnosis
from defras_bt.diagnosis.exhibits import Exhibits, ReplayFrame
from defras_bt.diagnosis.twins.tissue import TissueProblem
from defras_bt.diagnosis.twins.tissue_frames import TissueFrames
from defras_bt.diagnosis.twins.tissue_phases import PHASES
from defras_bt.diagnosis.twins.tissue_trajectory import Trajectory
from defras_bt.learning.misfit import misfit
from defras_sim.scene import Camera

MOST_FRAMES = 100
"""Shown of all recordings together."""


def tissue_exhibits(
    problem: TissueProblem, diagnosis: Diagnosis, most_frames: int = MOST_FRAMES
) -> Exhibits:
    """Frames of every recording of ``problem``, spread evenly over its time.

    Frames that one of the models could not follow are left out, and those without tissue in sight.

    Raises:
        ValueError: the diagnosis ended with a model that the twin cannot follow at all.
    """
    plain, extended = problem.frames(diagnosis.base), problem.frames(diagnosis.model)
    if plain is None or extended is None:
        raise ValueError("the twin cannot follow the model that the diagnosis ended with")
    each = max(1, most_frames // len(problem.trajectories))
    return Exhibits(
        replay=tuple(
            frame
            for trajectory, before, after in zip(problem.trajectories, plain, extended, strict=True)
            for frame in _frames(trajectory, before, after, problem.scene.depth_camera, each)
        )
    )


def _frames(
    trajectory: Trajectory, plain: TissueFrames, extended: TissueFrames, camera: Camera, most: int
) -> Iterator[ReplayFrame]:
    count = len(trajectory.frames)
    for index in np.unique(np.linspace(0, count - 1, min(most, count)).round().astype(int)):
        before, after = plain.surfaces[index], extended.surfaces[index]
        row, cloud_m = int(trajectory.frames[index]), trajectory.clouds_m[index]
        if before is None or after is None or not len(cloud_m):
            continue
        plain_cloud_m, extended_cloud_m = plain.corrected(cloud_m), extended.corrected(cloud_m)
        plain_off = misfit(plain_cloud_m, before, camera)
        extended_off = misfit(extended_cloud_m, after, camera)
        if plain_off is None or extended_off is None:
            continue
        arms = trajectory.motion.arms
        yield ReplayFrame(
            time_s=float(trajectory.time_s[index]),
            trajectory=trajectory.name,
            phase=PHASES[trajectory.phase[index]],
            plain=before,
            extended=after,
            plain_cloud_m=plain_cloud_m,
            extended_cloud_m=extended_cloud_m,
            before_m=plain_off.residual_m,
            after_m=extended_off.residual_m,
            tips_m={name: arm.position_m[row] for name, arm in arms.items()},
            held=tuple(name for name, arm in arms.items() if arm.grasped[row]),
        )
