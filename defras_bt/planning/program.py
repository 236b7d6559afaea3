"""The ASP programs, grounded once and kept alive between plans."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from clingo import Control, Function, Model, Number, Symbol

PROGRAMS = ("asp/retraction.lp", "asp/grasp_choice.lp", "asp/explain.lp")

# Of the weak constraints in asp/grasp_choice.lp, the most important first.
PRIORITIES = (5, 4, 3, 2, 1)

# Each try is a solve of its own; beyond this an explanation of a huge grid would take minutes.
MAX_DELETIONS = 60


class PlanningTimeout(Exception):
    """A solve took longer than it may. The planner stays usable."""


@dataclass(frozen=True)
class Answer:
    """The best answer set at a horizon: what it shows, and its cost per priority (5 to 1)."""

    shown: tuple[Symbol, ...]
    cost: tuple[int, ...]


class RetractionProgram:
    """One clingo control: the world is switched with externals, steps are added as needed."""

    def __init__(self, facts: str, files: Iterable[Path]) -> None:
        self._control = Control(["--warn=none"])
        for file in files:
            self._control.load(str(file))
        self._control.add("base", [], facts)
        self._control.ground([("base", [])])
        self._ground_check(0)
        self._steps = 0
        self._world: frozenset[Symbol] = frozenset()
        self._belief: tuple[int, str] | None = None
        self._beliefs = 0

    def set_world(self, atoms: Iterable[Symbol]) -> None:
        """Make exactly these external atoms true."""
        wanted = frozenset(atoms)
        for atom in self._world - wanted:
            self._control.assign_external(atom, False)
        for atom in wanted - self._world:
            self._control.assign_external(atom, True)
        self._world = wanted

    def set_belief(self, facts: str) -> None:
        """Take over distances to the believed attachments; ``k`` in them is the belief's number.

        Old beliefs are released for good, so that they cost nothing any more.
        """
        if self._belief is not None and self._belief[1] == facts:
            return
        if self._belief is not None:
            self._control.release_external(_numbered("current", self._belief[0]))
        self._beliefs += 1
        part = f"distances_{self._beliefs}"
        number = Number(self._beliefs)
        self._control.add(part, ["k"], facts)
        self._control.ground([(part, [number]), ("belief", [number])])
        self._control.assign_external(_numbered("current", self._beliefs), True)
        self._belief = (self._beliefs, facts)

    def best(self, horizon: int, budget_s: float) -> Answer | None:
        """The optimal plan of exactly ``horizon`` actions; None proves that there is none."""
        self._aim(horizon)
        answers: list[Answer] = []

        def keep(model: Model) -> None:
            by_priority = dict(zip(model.priority, model.cost, strict=True))
            cost = tuple(by_priority.get(priority, 0) for priority in PRIORITIES)
            answers[:] = [Answer(tuple(model.symbols(shown=True)), cost)]

        with self._control.solve(on_model=keep, async_=True) as handle:
            if not handle.wait(budget_s):
                handle.cancel()
                raise PlanningTimeout(f"no answer within {budget_s:g} s at {horizon} actions")
            result = handle.get()
        if not result.exhausted:
            raise RuntimeError(f"clingo stopped before it had searched all {horizon}-action plans")
        return answers[0] if result.satisfiable else None

    def conflict(
        self, horizon: int, removable: Sequence[Symbol], budget_s: float
    ) -> tuple[Symbol, ...] | None:
        """Facts out of ``removable`` that together rule out a plan of at most ``horizon`` actions.

        None if they do not. Only true external atoms can be removable; the others stay as they
        are. No fact can be dropped from the answer, except where trying would have taken more than
        ``MAX_DELETIONS`` solves or one of them more than ``budget_s``.
        """
        self._aim(horizon)
        for step in range(1, horizon + 1):  # steps may be left out, so that shorter plans count
            self._control.assign_external(_numbered("active", step), None)
        for atom in removable:
            self._control.assign_external(atom, None)
        try:
            core = self._core(removable, budget_s)
            return None if core is None else self._shrunk(core, budget_s)
        finally:
            for atom in removable:
                self._control.assign_external(atom, True)

    def _shrunk(self, core: Sequence[Symbol], budget_s: float) -> tuple[Symbol, ...]:
        """Drop every fact without which the rest still conflicts."""
        needed: list[Symbol] = []
        untried = list(core)
        for _ in range(MAX_DELETIONS):
            if not untried:
                break
            candidate = untried.pop(0)
            try:
                smaller = self._core([*needed, *untried], budget_s)
            except PlanningTimeout:  # the facts left still rule out every plan
                return (*needed, candidate, *untried)
            if smaller is None:
                needed.append(candidate)
            else:
                kept = set(smaller)
                untried = [atom for atom in untried if atom in kept]
        return (*needed, *untried)

    def _core(self, assumed: Sequence[Symbol], budget_s: float) -> tuple[Symbol, ...] | None:
        """Assumptions that clingo used to refute all plans; None if there is a plan."""
        by_literal = {self._control.symbolic_atoms[atom].literal: atom for atom in assumed}
        pairs = [(atom, True) for atom in assumed]
        with self._control.solve(assumptions=pairs, async_=True) as handle:
            if not handle.wait(budget_s):
                handle.cancel()
                raise PlanningTimeout(f"no explanation within {budget_s:g} s")
            if handle.get().satisfiable:
                return None
            return tuple(by_literal[literal] for literal in handle.core() if literal in by_literal)

    def _aim(self, horizon: int) -> None:
        """Ask for the goal after ``horizon`` steps, with only these steps switched on."""
        while self._steps < horizon:
            self._steps += 1
            self._control.ground([("step", [Number(self._steps)])])
            self._ground_check(self._steps)
        for step in range(self._steps + 1):
            self._control.assign_external(_numbered("query", step), step == horizon)
            if step:
                self._control.assign_external(_numbered("active", step), step <= horizon)

    def _ground_check(self, step: int) -> None:
        self._control.ground([("check", [Number(step)])])


def _numbered(name: str, number: int) -> Symbol:
    return Function(name, [Number(number)])
