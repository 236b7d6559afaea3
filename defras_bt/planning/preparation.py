"""What an operation needs to know before it starts: the force threshold, and perhaps a plan."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from defras_bt.executive.tree_spec import TreeSpec
from defras_bt.planning.engine import Engine
from defras_bt.planning.plan import Plan
from defras_bt.planning.plan_file import load_plan
from defras_bt.planning.preoperative import PreoperativeResult, preoperative_plan
from defras_bt.planning.rehearsals import Progress
from defras_sim.scene import Scene


@dataclass(frozen=True)
class Preparation:
    """``result`` is None where nothing was rehearsed: the scene gives the threshold itself."""

    force_threshold_n: float
    result: PreoperativeResult | None

    @property
    def plan(self) -> Plan | None:
        return self.result.plan if self.result is not None else None


def needs_plan(tree: TreeSpec) -> bool:
    """Whether the tree uses a plan made before the operation."""
    return any(spec.kind == "UsePreoperativePlan" for _, spec in tree.root.walk())


def prepare(
    scene: Scene,
    *,
    with_plan: bool = True,
    plan_file: Path | None = None,
    engine: Engine | None = None,
    progress: Progress | None = None,
) -> Preparation:
    """Read the plan file, or rehearse now. Without a plan to make and with a threshold in the
    scene there is nothing to do.

    Raises:
        InvalidPlanFile: the plan file cannot be read.
        StalePlanFile: it was made for another scene.
    """
    if plan_file is not None:
        result = load_plan(plan_file, scene)
        return Preparation(result.force_threshold_n, result)
    if not with_plan and scene.thresholds.force_n is not None:
        return Preparation(scene.thresholds.force_n, None)
    result = preoperative_plan(scene, engine=engine, progress=progress)
    return Preparation(result.force_threshold_n, result if with_plan else None)
