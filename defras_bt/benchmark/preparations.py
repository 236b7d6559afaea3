"""What is made before the retractions of a benchmark: the force threshold, and a plan for each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from defras_bt.benchmark.cases import configurations, shipped
from defras_bt.planning.choice import qualified, threshold_n
from defras_bt.planning.engine import Engine
from defras_bt.planning.gentlest import rehearse_gentlest
from defras_bt.planning.journal import Journal
from defras_bt.planning.plan import Plan
from defras_bt.planning.preoperative import PreoperativeResult, preoperative_plans, result_of
from defras_bt.planning.rehearsals import Progress, rehearse_all
from defras_bt.planning.robust import sampled_beliefs
from defras_bt.planning.scene_hash import scene_hash
from defras_sim.scene import Scene

FORCE_THRESHOLD_N = 0.6
"""About twice the median of the largest forces over the rehearsals of the 17 configurations."""


@dataclass(frozen=True)
class Preparations:
    """Plans by scene content, and F_m over the 17 configurations."""

    plans: Mapping[str, PreoperativeResult]
    force_median_n: float


def prepared(
    world: str,
    *,
    jobs: int = -1,
    journal: Journal | None = None,
    progress: Progress | None = None,
) -> Preparations:
    """Rehearse all grasp points of the 17 configurations: epsilon, and a plan for each."""
    scenes = [in_world(shipped(name), world) for name in configurations()]
    results = preoperative_plans(
        scenes, engine=Engine(jobs=jobs), journal=journal, progress=progress
    )
    return Preparations({r.scene_hash: r for r in results}, results[0].force_median_n)


def in_world(scene: Scene, world: str) -> Scene:
    """The scene as its twin has it in ``world``."""
    return scene.for_bullet() if world == "bullet" else scene


class Plans:
    """Pre-operative plans; one that nobody has made yet is made when it is asked for, and kept."""

    def __init__(self, preparations: Preparations) -> None:
        self._preparations = preparations
        self._made: dict[str, Plan] = {}

    def threshold_n(self, scene: Scene) -> float:
        """Epsilon [N]: what the scene states, or twice F_m."""
        return threshold_n(scene, self._preparations.force_median_n)

    def plan(self, scene: Scene, samples: int, seed: int) -> Plan:
        """``samples``: sets of attachments around the belief over which it is chosen, if any."""
        key, median_n = scene_hash(scene), self._preparations.force_median_n
        known = self._preparations.plans.get(key)
        if samples:
            alone = Engine(jobs=1)
            executions = known.executions if known else rehearse_all([scene], engine=alone)[0]
            points = {e.point for e in qualified(scene, executions, median_n)}
            around = sampled_beliefs(scene, samples, np.random.default_rng([seed, samples]))
            elsewhere = rehearse_all(around, engine=alone, only=[points] * samples)
            return result_of(scene, executions, median_n, elsewhere).plan
        if known is not None:
            return known.plan
        if key not in self._made:
            executions = rehearse_gentlest(scene, self.threshold_n(scene))
            self._made[key] = result_of(scene, executions, median_n).plan
        return self._made[key]
