"""Whether an arm, where it really stands, can reach what it may be told to."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from defras_bt.dvrk.checking.bench import CheckBench
from defras_bt.dvrk.checking.finding import Finding, ok, skipped, warning, wrong
from defras_sim.arm.closed_form import Undetermined, joints_of
from defras_sim.arm.dh import JOINT_HIGH, JOINT_NAMES
from defras_sim.arm.limits import LOW
from defras_sim.geometry import Floats, Pose
from defras_sim.motion import manoeuvre_target_m
from defras_sim.scene import ArmName, GraspPoint, Scene

_MANOEUVRES = ("pull", "move", "fold")


class WorkspaceCheck:
    """Every grasp point of the arm's side from above, and the ends of every manoeuvre from there,
    with the tip turned as it is now."""

    def run(self, bench: CheckBench) -> list[Finding]:
        return [self._one(bench, name) for name in bench.setup.arms]

    def _one(self, bench: CheckBench, name: ArmName) -> Finding:
        arm, scene = bench.arms[name], bench.scene
        seen = arm.measured_cp.message
        if seen is None:
            return skipped("workspace", arm.name, "its pose does not come")
        base = bench.registration.arms[name].pose
        turn = (base @ seen.pose).rotation
        points = [point for point in scene.grasp_points if name in scene.arms_at(*point)]
        unreached: dict[GraspPoint, str] = {}
        short: dict[GraspPoint, str] = {}
        for point in points:
            for found, places in ((unreached, _taking(scene, point)), (short, _ends(scene, point))):
                why = next(filter(None, (_broken(base, Pose(m, turn)) for m in places)), "")
                if why:
                    found[point] = why
        if len(unreached) == len(points):
            what = f"reaches none of its {len(points)} grasp points: {_first(unreached)}"
            return wrong("workspace", arm.name, what, "Move the arm's base or the tissue.")
        if unreached or short:
            what = (
                f"reaches {len(points) - len(unreached)} of {len(points)} grasp points, and the "
                f"end of every manoeuvre from {len(points) - len({**unreached, **short})}: "
                f"{_first({**short, **unreached})}"
            )
            todo = "Motion ends at the limits; a base nearer to the tissue would reach more."
            return warning("workspace", arm.name, what, todo)
        what = f"reaches all its {len(points)} grasp points, and the ends of all manoeuvres"
        return ok("workspace", arm.name, what)


def _taking(scene: Scene, point: GraspPoint) -> Iterator[Floats]:
    at_m = scene.grasp_point_m(*point)
    above_m = float(scene.tissue.shape.high_m[2]) + scene.motion.clearance_m
    yield np.array([*at_m[:2], above_m])
    yield at_m


def _ends(scene: Scene, point: GraspPoint) -> Iterator[Floats]:
    place_m = scene.grasp_point_m(*point)
    for manoeuvre in _MANOEUVRES:
        place_m = manoeuvre_target_m(scene, manoeuvre, place_m)
        yield place_m


def _broken(tissue_from_base: Pose, tissue_from_tip: Pose) -> str:
    """Which joint would leave its limits; "" if none."""
    try:
        joints = joints_of(tissue_from_base.inverse() @ tissue_from_tip)
    except Undetermined as error:
        return str(error)
    for joint, (value, low, high) in enumerate(zip(joints, LOW, JOINT_HIGH, strict=True)):
        if not low <= value <= high:
            return f"{JOINT_NAMES[joint]} would be {value:.3f}, allowed are {low:g} to {high:g}"
    return ""


def _first(found: dict[GraspPoint, str]) -> str:
    point, why = next(iter(found.items()))
    return f"at {point}, {why}"
