"""The tissue model over a bed: how long a frame takes, and how deep the tissue gets into the bed.

Nothing is compared with here: a bed is a law of contact, which every model has its own of. Where a
sheet wrinkles or folds onto the bed, one millimetre of the tool can mean a jump of the tissue.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter, process_time

import numpy as np
from scipy.spatial.transform import Rotation

from defras_bt.benchmark.tissue_motions import MOTIONS, ONE_SIDE, TWO_EDGES, Motion
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import MaterialName, Tissue
from defras_sim.tissue.bed import Bed
from defras_sim.tissue.model import TissueModel

ARM = "psm1"
STEP_M = 0.001

PLANAR = Motion(
    "planar_60", "Planar move of 60 mm", TWO_EDGES, (0.0, -0.025), ((0, 0, 0.01), (0, 0.06, 0.01))
)
FOLD = Motion(
    "fold_180", "Fold over by 180 degrees", ONE_SIDE, (0.05, 0.0), ((0, 0, 0.05), (-0.08, 0, 0.02))
)
BED_MOTIONS = (*MOTIONS, PLANAR, FOLD)


@dataclass(frozen=True)
class OverBed:
    """One motion over a bed; lists have an entry for each frame of 1 mm of the tool.

    ``frames_s`` (n,) are wall times, ``computing_s`` (n,) what all cores worked; ``depth_m`` (n,)
    is how far the tissue reaches into the bed, ``stale`` how many frames did not converge.
    """

    motion: Motion
    material: MaterialName
    frames_s: Floats
    computing_s: Floats
    depth_m: Floats
    stale: int

    def __str__(self) -> str:
        return (
            f"{self.motion.title} over a bed, {self.material}: "
            f"{1e3 * np.median(self.frames_s):.3g} ms a frame, "
            f"at most {1e3 * self.depth_m.max():.2f} mm into the bed"
        )

    def row(self) -> dict[str, object]:
        return {
            "motion": self.motion.title,
            "material": self.material,
            "frames": len(self.frames_s),
            "stale": self.stale,
            "frame median ms": 1e3 * float(np.median(self.frames_s)),
            "frame 99 % ms": 1e3 * float(np.percentile(self.frames_s, 99)),
            "computing median ms": 1e3 * float(np.median(self.computing_s)),
            "computing 99 % ms": 1e3 * float(np.percentile(self.computing_s, 99)),
            "deepest mm": 1e3 * float(self.depth_m.max()),
        }


def over_bed(motion: Motion, material: MaterialName) -> OverBed:
    """Follow ``motion`` in steps of 1 mm; the fold turns the jaw by 180 degrees on its way."""
    scene = motion.scene()
    scene = scene.model_copy(update={"tissue": Tissue(bed=True)})
    model = TissueModel(scene, material=material)
    bed = model.terms["bed"]
    if not isinstance(bed, Bed):
        raise TypeError(f"the term named bed is a {type(bed).__name__}")
    model.grasp(ARM, motion.start)
    model.solve({ARM: motion.start})
    frames, computing, depths, stale = [], [], [], 0
    for tip in tips(motion):
        begun, worked = perf_counter(), process_time()
        state = model.solve({ARM: tip})
        frames.append(perf_counter() - begun)
        computing.append(process_time() - worked)
        depths.append(bed.deepest_m(state.nodes_m))
        stale += not state.converged
    return OverBed(motion, material, np.array(frames), np.array(computing), np.array(depths), stale)


def tips(motion: Motion) -> list[Pose]:
    """Poses of the tip, 1 mm apart; a fold turns evenly along the part of its way that leads back.

    It turns about y, so that what was the upper face of the tissue comes to lie below.
    """
    straight = motion.tips(STEP_M)
    if motion is not FOLD:
        return straight
    lift = round(FOLD.way_m[0][2] / STEP_M)
    back = len(straight) - lift
    turns = np.concatenate([np.zeros(lift), np.pi * np.arange(1, back + 1) / back])
    return [
        Pose(tip.position_m, Rotation.from_rotvec([0.0, -angle, 0.0]).as_matrix() @ tip.rotation)
        for tip, angle in zip(straight, turns, strict=True)
    ]


def bed_row(runs: Sequence[OverBed]) -> dict[str, object]:
    """All motions together."""
    frames, computing = (
        np.concatenate([getattr(run, name) for run in runs]) for name in ("frames_s", "computing_s")
    )
    return {
        "motion": "all",
        "material": "both",
        "frames": len(frames),
        "stale": sum(run.stale for run in runs),
        "frame median ms": 1e3 * float(np.median(frames)),
        "frame 99 % ms": 1e3 * float(np.percentile(frames, 99)),
        "computing median ms": 1e3 * float(np.median(computing)),
        "computing 99 % ms": 1e3 * float(np.percentile(computing, 99)),
        "deepest mm": 1e3 * max(float(run.depth_m.max()) for run in runs),
    }
