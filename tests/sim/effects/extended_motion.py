"""A small retraction that tests of effects on tissue share."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from defras_sim.effects.effect import Extension
from defras_sim.effects.extended_tissue import ExtendedTissue
from defras_sim.geometry import Pose
from defras_sim.scene import Attachments, Roi, Scene, Tissue
from defras_sim.tissue.state import TissueState

ARM = "psm1"
GRASPED = Pose(np.array([0.030, 0.04 / 3, 0.0]))
TURN = Rotation.from_rotvec([0.1, -0.5, 0.2]).as_matrix()
RAISED = Pose(np.array([0.022, 0.012, 0.025]), TURN)
FOLDED = Pose(np.array([-0.002, 0.012, 0.032]), TURN @ TURN)
SMALL = {"length_x_m": 0.08, "width_y_m": 0.08, "elements_xyz": (4, 4, 1)}
HALFWAY = Pose(np.array([0.027, 0.014, 0.012]), Rotation.from_rotvec([0, -0.2, 0]).as_matrix())


def scene(**tissue: object) -> Scene:
    """The two columns of holes at the smallest x, and a patch further in, hold."""
    rows = ["##......"] * 2 + ["##.##..."] * 2 + ["##......"] * 4
    return Scene(
        name="small",
        attachments=Attachments(map=tuple(rows)),
        roi=Roi(center_x_m=0.0, center_y_m=0.0, radius_m=0.01),
        tissue=Tissue.model_validate({**SMALL, **tissue}),
    )


def extended(
    extension: Extension, residual_share: float = 1e-7, **tissue: object
) -> ExtendedTissue:
    return ExtendedTissue(scene(**tissue), extension, residual_share=residual_share)


def retract(tissue: ExtendedTissue, *poses: Pose, step_s: float = 1.0) -> TissueState:
    """Grasp at time 0 and go through the poses, one a step; the last state."""
    tissue.solve({}, 0.0)
    tissue.grasp(ARM, GRASPED)
    state = tissue.solve({ARM: GRASPED}, 0.0)
    for number, pose in enumerate(poses, start=1):
        state = tissue.solve({ARM: pose}, number * step_s)
        assert state.converged
    return state
