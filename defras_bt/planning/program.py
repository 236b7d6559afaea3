"""The ASP programs, grounded once and kept alive between plans."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from clingo import Control, Function, Model, Number, Symbol

PROGRAMS = ("asp/retraction.lp", "asp/advice.lp", "asp/grasp_choice.lp", "asp/explain.lp")

# Of the weak constraints in asp/advice.lp (6) and asp/grasp_choice.lp, the most important first.
PRIORITIES = (6, 5, 4, 3, 2, 1)

# Each try is a solve of its own; beyond this an explanation of a huge grid would take minutes.
MAX_DELETIONS = 60


class PlanningTimeout(Exception):
    """A solve took longer than it may. The planner stays usable."""


@dataclass(frozen=True)
class Answer:
    """The best answer set at a horizon: what it shows, and its cost per priority (6 to 1)."""

    shown: tuple[Symbol, ...]
    cost: tuple[int, ...]

    def by_name(self) -> dict[str, list[Symbol]]:
        """The shown atoms by their predicate."""
        found: dict[str, list[Symbol]] = {}
        for atom in self.shown:
            found.setdefault(atom.name, []).append(atom)
        return found


class RetractionProgram:
    """One clingo control, grounded once for plans of at most ``horizon`` actions.

    Between solves the world is switched with externals, and the belief is exchanged.
    """

    def __init__(self, facts: str, files: Iterable[Path], horizon: int) -> None:
        self._control = Control(["--warn=none"])
        for file in files:
            self._control.load(str(file))
        self._control.add("base", [], facts)
        steps = [("step", [Number(step)]) for step in range(1, horizon + 1)]
        self._control.ground([("base", []), *steps, ("goal", [Number(horizon)])])
        self._world: frozenset[Symbol] = frozenset()
        self._belief: tuple[int, str] | None = None
        self._beliefs = 0

    @property
    def beliefs(self) -> int:
        """How many beliefs this control has seen."""
        return self._beliefs

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

        Old beliefs are released for good, but clingo still looks through their atoms when it
        grounds: see :attr:`beliefs`.
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

    def best(self, budget_s: float) -> Answer | None:
        """The optimal plan; None proves that there is none.

        Raises:
            PlanningTimeout: neither was proved within ``budget_s``.
        """
        answers: list[Answer] = []

        def keep(model: Model) -> None:
            by_priority = dict(zip(model.priority, model.cost, strict=True))
            cost = tuple(by_priority.get(priority, 0) for priority in PRIORITIES)
            answers[:] = [Answer(tuple(model.symbols(shown=True)), cost)]

        with self._control.solve(on_model=keep, async_=True) as handle:
            if not handle.wait(budget_s):
                handle.cancel()
                raise PlanningTimeout(f"no best plan within {budget_s:g} s")
            result = handle.get()
        if not result.exhausted:
            raise RuntimeError("clingo stopped before it had searched all plans")
        return answers[0] if result.satisfiable else None

    def conflict(self, removable: Sequence[Symbol], budget_s: float) -> tuple[Symbol, ...] | None:
        """Facts out of ``removable`` that together rule out every plan.

        None if they do not. Only true external atoms can be removable; the others stay as they
        are. No fact can be dropped from the answer, except where trying would have taken more than
        ``MAX_DELETIONS`` solves or one of them more than ``budget_s``.
        """
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


def _numbered(name: str, number: int) -> Symbol:
    return Function(name, [Number(number)])
