"""Which point the driver calls the tip, and whether the kinematics are those of the tool."""

from __future__ import annotations

import numpy as np

from defras_bt.dvrk.arm_frames import ArmFrames
from defras_bt.dvrk.checking.bench import CheckBench
from defras_bt.dvrk.checking.finding import Finding, ok, skipped, wrong
from defras_bt.dvrk.crtk.arm import CrtkArm
from defras_sim.arm.dh import WRIST_TO_TIP_M, link_poses
from defras_sim.arm.kinematics import tip_pose

_SAME_M = 0.001
_ROTATION_RAD = 0.03


class TipCheck:
    """Compares ``local/measured_cp`` with what joints and kinematics say.

    Of a ProGrasp, the wrist's yaw axis and the jaw's end lie 28.6 mm apart: to take one for the
    other drives the jaw into the tissue.
    """

    def run(self, bench: CheckBench) -> list[Finding]:
        return [self._one(arm) for arm in bench.arms.values()]

    def _one(self, arm: CrtkArm) -> Finding:
        local, joints = arm.local_cp.message, arm.measured_js.message
        if local is None:
            what = "local/measured_cp does not come, so nothing tells which point it is"
            todo = "Have the driver publish local/measured_cp, or see the motion check."
            return skipped("tip", arm.name, what, todo)
        if joints is None or len(joints.position) != 6:
            return wrong("tip", arm.name, "six joints are needed", "See the findings about names.")
        wrist_m = link_poses(joints.position)[-1].position_m
        tip = tip_pose(joints.position)
        frames = ArmFrames.of(arm.setup, local.pose)
        own_m = np.linalg.norm((local.pose @ frames.reported_from_tip).position_m - tip.position_m)
        along = local.pose.rotation[:, 2] @ tip.rotation[:, 2]
        if np.arccos(np.clip(along, -1.0, 1.0)) > _ROTATION_RAD:
            what = "the z axis of its poses does not point along the jaw"
            todo = "Set the tool of the driver to its own file (PROGRASP_FORCEPS_400093.json)."
            return wrong("tip", arm.name, what, todo)
        if own_m <= _SAME_M:
            point = "wrist's yaw axis" if arm.setup.reported == "wrist" else "jaw's end"
            return ok("tip", arm.name, f"poses are those of the {point}, of a ProGrasp")
        place_m = local.pose.position_m
        off_wrist_m = float(np.linalg.norm(place_m - wrist_m))
        off_jaw_m = float(np.linalg.norm(place_m - tip.position_m))
        for point, name, off_m in (
            ("wrist", "wrist's yaw axis", off_wrist_m),
            ("jaw", "jaw's end", off_jaw_m),
        ):
            if off_m <= _SAME_M and arm.setup.reported != point:
                what = f"poses are those of the {name}, not of the {arm.setup.reported}"
                return wrong("tip", arm.name, what, f"Set arms.*.reported: {point}.")
        what = (
            f"the tip would be {own_m * 1e3:.1f} mm away from where the joints put a ProGrasp's; "
            f"its pose is {off_wrist_m * 1e3:.1f} mm from the wrist's yaw axis and "
            f"{off_jaw_m * 1e3:.1f} mm from the jaw's end ({WRIST_TO_TIP_M * 1e3:g} mm beyond it)"
        )
        todo = "Another tool is mounted or configured: the twin and the limits are a ProGrasp's."
        return wrong("tip", arm.name, what, todo)
