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
    advice_fact,
    advised,
    attachment_distances_mm,
    belief_facts,
    require_valid,
    roi_distances_mm,
    scene_facts,
    world_atoms,
)
from defras_bt.planning.plan import ACTIONS, Action, GridPoint, Plan, Situation
from defras_bt.planning.program import PROGRAMS, Answer, RetractionProgram
from defras_sim.advice import Matter
from defras_sim.resources import resource
from defras_sim.scene import Scene

# Both arms let go, one reaches, opens, grasps, pulls, moves and folds.
MAX_HORIZON = 8

# Every belief makes a control a little slower (5x5 points: 0.02 ms a plan, 10x10: 0.2 ms); a new
# control costs as much as some plans.
MAX_BELIEFS = 16


class NoPlan(Exception):
    """The region cannot be exposed. ``obstacles``: an irreducible set of facts in the way."""

    def __init__(self, horizon: int, obstacles: Sequence[str]) -> None:
        self.horizon = horizon
        self.obstacles = tuple(obstacles)
        why = "; ".join(obstacles) if obstacles else "any plan needs more actions than that"
        super().__init__(f"no plan of at most {horizon} actions exposes the region: {why}")


class Planner:
    """Plans for one scene. A clingo control lives for many plans.

    One optimisation finds the best plan and proves it: fewest actions first, then what
    asp/grasp_choice.lp prefers. The best is unique, so the answer does not depend on what was
    asked before.

    Args:
        scene: arms, grasp points and region of interest; its attachments are not used.
        max_horizon: longest plan looked for.
        budget_s: longest time for one solve, after which it is cancelled.
        programs: the ASP programs, by default those in asp/.
        demanded: only plans with such an action, to answer "why not".
    """

    def __init__(
        self,
        scene: Scene,
        *,
        max_horizon: int = MAX_HORIZON,
        budget_s: float = 10.0,
        programs: Iterable[Path] | None = None,
        demanded: Matter | None = None,
    ) -> None:
        self.scene = scene
        self.max_horizon = max_horizon
        self.budget_s = budget_s
        files = [resource(name) for name in PROGRAMS] if programs is None else list(programs)
        self._files = files
        self._rules = range(len(scene.advice))
        self._facts = scene_facts(scene)
        if demanded is not None:
            self._facts += "\n" + advice_fact(len(scene.advice), "demand", demanded)
            self._rules = range(len(scene.advice) + 1)
        self._program = self._grounded()
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
        world |= {advised(number) for number in self._rules}
        attachment_mm = attachment_distances_mm(self.scene, attached)
        if self._program.beliefs >= MAX_BELIEFS:
            self._program = self._grounded()
        self._program.set_world(world)
        self._program.set_belief(belief_facts(attachment_mm))
        answer = self._program.best(self.budget_s)
        if answer is None:
            raise NoPlan(self.max_horizon, self._obstacles(world, required_grasp))
        return self._plan_from(answer, situation, attachment_mm)

    def _grounded(self) -> RetractionProgram:
        return RetractionProgram(self._facts, self._files, self.max_horizon)

    def _plan_from(
        self, answer: Answer, situation: Situation, attachment_mm: dict[GridPoint, int]
    ) -> Plan:
        shown = answer.by_name()
        target = point_of(shown["final_grasp"][0].arguments[0])
        why = {
            atom.arguments[2].number: atom.arguments[1].name for atom in shown.get("because", [])
        }
        followed: dict[int, list[str]] = {}
        for atom in shown.get("follows", []):
            rule, time = (argument.number for argument in atom.arguments)
            followed.setdefault(time, []).append(self.scene.advice[rule].sentence())
        steps = [atom for name, atoms in shown.items() if name in ACTIONS for atom in atoms]
        actions = tuple(
            sorted((_action(step, situation, target) for step in steps), key=lambda a: a.time)
        )
        return Plan(
            actions=actions,
            cost=answer.cost,
            proved_shortest=True,
            reasons=tuple(
                "; ".join(
                    [
                        self._reason(why[action.time], action, attachment_mm),
                        *followed.get(action.time, []),
                    ]
                )
                for action in actions
            ),
        )

    def _reason(self, why: str, action: Action, attachment_mm: dict[GridPoint, int]) -> str:
        point = action.point
        if point is None:
            raise RuntimeError(f"asp/retraction.lp shows {action} without a grasp point")
        return reason_sentence(why, point, self._roi_mm[point], attachment_mm.get(point))

    def _obstacles(self, world: set[Symbol], required: GridPoint | None) -> list[str]:
        removable = sorted(world)
        core = self._program.conflict(removable, self.budget_s)
        if core is None:
            raise RuntimeError("a plan exists that the optimisation did not find")
        sentences = list(obstacle_sentences(core, len(self.scene.grasp_points)))
        in_the_way = {atom.arguments[0].number for atom in core if atom.name == "advised"}
        sentences += [
            rule.sentence() for i, rule in enumerate(self.scene.advice) if i in in_the_way
        ]
        if required is not None and not self.scene.arms_at(*required):
            sentences.append(
                f"{point_text(required)} lies on the side of the x-z plane that no arm reaches; "
                f"this scene has {', '.join(sorted(self.scene.arms))}"
            )
        return sentences


def _action(atom: Symbol, situation: Situation, target: GridPoint) -> Action:
    tool, _, place, time = atom.arguments
    point = target if place.name == "target" else situation.arms[tool.name].holding
    return Action(name=atom.name, arm=tool.name, point=point, time=time.number)
