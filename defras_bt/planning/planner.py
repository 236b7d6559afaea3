"""Shortest plans to expose the region of interest, re-planned from whatever is sensed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from clingo import Symbol
from numpy.typing import NDArray

from defras_bt.planning.english import (
    obstacle_sentences,
    point_of,
    point_text,
    reason_sentence,
)
from defras_bt.planning.facts import (
    attachment_distances_mm,
    belief_facts,
    require_valid,
    roi_distances_mm,
    scene_facts,
    world_atoms,
)
from defras_bt.planning.plan import Action, GridPoint, Plan, Situation
from defras_bt.planning.program import PROGRAMS, Answer, RetractionProgram
from defras_sim.resources import resource
from defras_sim.scene import Scene

# Both arms let go, one reaches, opens, grasps, pulls, moves and folds: 8. The rest is reserve.
MAX_HORIZON = 12


class NoPlan(Exception):
    """The region cannot be exposed. ``obstacles``: an irreducible set of facts in the way."""

    def __init__(self, horizon: int, obstacles: Sequence[str]) -> None:
        self.horizon = horizon
        self.obstacles = tuple(obstacles)
        why = "; ".join(obstacles) if obstacles else "any plan needs more actions than that"
        super().__init__(f"no plan of at most {horizon} actions exposes the region: {why}")


class Planner:
    """Plans for one scene. One clingo control lives as long as the planner does.

    Horizons ascend from 0. Each one refuted proves that no plan is that short; at the first one
    that is not, asp/grasp_choice.lp says which of the shortest plans is best. The best is unique,
    so the answer does not depend on what was asked before.

    Args:
        scene: arms, grasp points and region of interest; its attachments are not used.
        max_horizon: longest plan looked for.
        budget_s: longest time for one solve, after which it is cancelled.
        programs: the ASP programs, by default those in asp/.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        max_horizon: int = MAX_HORIZON,
        budget_s: float = 10.0,
        programs: Iterable[Path] | None = None,
    ) -> None:
        self.scene = scene
        self.max_horizon = max_horizon
        self.budget_s = budget_s
        files = [resource(name) for name in PROGRAMS] if programs is None else list(programs)
        self._program = RetractionProgram(scene_facts(scene), files)
        self._roi_mm = roi_distances_mm(scene)

    def plan(
        self,
        situation: Situation,
        attached: NDArray[np.bool_],
        *,
        required_grasp: GridPoint | None = None,
        exposing: Sequence[str] | None = None,
    ) -> Plan:
        """The best of the shortest plans.

        Args:
            situation: the sensed state and what is blocked.
            attached: (holes,) the holes believed to hold.
            required_grasp: only plans that end up holding this point.
            exposing: manoeuvres that expose, instead of ``situation.exposing``.

        Raises:
            NoPlan: with the facts in the way.
            PlanningTimeout: a solve took longer than the budget.
            ValueError: the situation does not fit the scene.
        """
        needed = tuple(situation.exposing if exposing is None else exposing)
        require_valid(self.scene, situation, needed, required_grasp)
        world = world_atoms(situation, needed, required_grasp)
        attachment_mm = attachment_distances_mm(self.scene, attached)
        self._program.set_world(world)
        self._program.set_belief(belief_facts(attachment_mm))
        for horizon in range(self.max_horizon + 1):
            answer = self._program.best(horizon, self.budget_s)
            if answer is not None:
                return self._plan_from(answer, attachment_mm)
        raise NoPlan(self.max_horizon, self._obstacles(world, required_grasp))

    def _plan_from(self, answer: Answer, attachment_mm: dict[GridPoint, int]) -> Plan:
        why = {
            atom.arguments[2].number: atom.arguments[1].name
            for atom in answer.shown
            if atom.name == "because"
        }
        steps = [atom for atom in answer.shown if atom.name != "because"]
        steps.sort(key=lambda atom: atom.arguments[3].number)
        return Plan(
            actions=tuple(_action_from(step) for step in steps),
            cost=answer.cost,
            proved_shortest=True,
            reasons=tuple(
                self._reason(why[step.arguments[3].number], step, attachment_mm) for step in steps
            ),
        )

    def _reason(self, reason: str, step: Symbol, attachment_mm: dict[GridPoint, int]) -> str:
        point = point_of(step.arguments[2])
        return reason_sentence(reason, point, self._roi_mm[point], attachment_mm.get(point))

    def _obstacles(self, world: set[Symbol], required: GridPoint | None) -> list[str]:
        removable = sorted(world)
        core = self._program.conflict(self.max_horizon, removable, self.budget_s)
        if core is None:
            raise RuntimeError("a plan exists that the ascending search did not find")
        sentences = list(obstacle_sentences(core, len(self.scene.grasp_points)))
        if required is not None and not self.scene.arms_at(*required):
            sentences.append(
                f"{point_text(required)} lies on the side of the x-z plane that no arm reaches; "
                f"this scene has {', '.join(sorted(self.scene.arms))}"
            )
        return sentences


def _action_from(atom: Symbol) -> Action:
    tool, _, point, time = atom.arguments
    return Action(name=atom.name, arm=tool.name, point=point_of(point), time=time.number)
