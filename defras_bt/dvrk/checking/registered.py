"""Whether the registration is one to trust, and fits the scene."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from defras_bt.dvrk.checking.bench import CheckBench
from defras_bt.dvrk.checking.finding import Finding, ok, warning, wrong
from defras_bt.dvrk.registering.registration import Placed
from defras_sim.scene_parts import Arm

_AWAY_M = 0.01
_TURNED_RAD = 0.15


class RegistrationCheck:
    """Residuals of every arm and camera, and the arms' remote centres beside the scene's."""

    def run(self, bench: CheckBench) -> list[Finding]:
        limit_m = bench.setup.limits.residual_m
        placed: dict[str, Placed] = dict(bench.registration.arms.items())
        placed.update(bench.registration.cameras.items())
        findings = [_residuals(name, one, limit_m) for name, one in placed.items()]
        for name in bench.setup.arms:
            findings.append(_stands(name, bench.registration.arms[name], bench.scene.arms[name]))
        return findings


def _residuals(name: str, placed: Placed, limit_m: float) -> Finding:
    if placed.rms_m is None:
        what = "was entered by hand; nothing says how well it fits"
        return warning("registration", name, what, f"Measure it: defras dvrk register {name}.")
    worst_m = placed.left_out_m if placed.left_out_m is not None else placed.rms_m
    what = (
        f"{placed.landmarks} landmarks, {placed.rms_m * 1e3:.1f} mm off on average, a new one "
        f"{worst_m * 1e3:.1f} mm at worst"
    )
    if placed.rms_m > limit_m:
        todo = f"Register it anew; {limit_m * 1e3:g} mm are allowed on average."
        return wrong("registration", name, what, todo)
    if worst_m > 2.0 * limit_m:
        todo = "One landmark is off: touch or see it again."
        return warning("registration", name, what, todo)
    return ok("registration", name, what)


def _stands(name: str, placed: Placed, arm: Arm) -> Finding:
    """The gate keeps the joint limits of an arm that stands where the scene says."""
    pose = placed.pose
    away_m = float(np.linalg.norm(pose.position_m - np.array(arm.rcm_m)))
    turned_rad = float(Rotation.from_matrix(pose.rotation).magnitude())
    here = ", ".join(f"{value:.4f}" for value in pose.position_m)
    if away_m > _AWAY_M:
        what = f"its frame's origin is registered {away_m * 1e3:.0f} mm away from the scene's"
        todo = f"Set arms.{name}.rcm_m: [{here}] in the scene, if that is the remote centre."
        return wrong("scene", name, what, todo)
    if turned_rad > _TURNED_RAD:
        what = f"its frame is turned by {np.degrees(turned_rad):.0f} degrees against the tissue's"
        todo = (
            "Limits of joints are kept for a frame that is not turned; rely on the workspace "
            "finding, or stand the arm upright."
        )
        return warning("scene", name, what, todo)
    return ok("scene", name, "stands where the scene has it")
