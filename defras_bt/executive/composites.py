"""The composite that carries out a plan."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from defras_bt.executive import quiet
from defras_bt.executive.reasons import Code


class PlanSlot(quiet.Sequence):
    """The place in a tree where the actions of a plan are carried out, in order and once.

    An empty py_trees sequence succeeds, and a pre-empted or finished one starts again at its first
    child: both would move tissue on the strength of a plan that no longer holds. A slot therefore
    FAILS unless it was filled with a plan, and a plan is *spent* as soon as it finished, failed or
    was interrupted by a guard: the slot then fails until it is filled anew from what is now true.

    Attributes:
        code: why the slot reports what it does: one of the codes of plans.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name, memory=True)
        self.code: Code = Code.NO_PLAN
        self.feedback_message = "there is no plan"
        self._ticking = False

    @property
    def needs_plan(self) -> bool:
        """Whether the slot holds nothing that could be carried out: no plan, or a spent one."""
        return self.code not in (Code.PLAN_READY, Code.PLAN_RUNNING)

    @property
    def step(self) -> int | None:
        """0-based index of the action being carried out; None while none is."""
        if self.status != Status.RUNNING or self.current_child is None:
            return None
        return self.children.index(self.current_child)

    def fill(self, actions: Sequence[Behaviour]) -> None:
        """Replace what the slot holds by ``actions``; those held before are terminated first.

        Raises:
            ValueError: no actions, two of the same name, a name with "/", or an action that is in a
                tree already. The slot then still holds what it held.
            RuntimeError: called by one of the slot's own actions.
        """
        names = [action.name for action in actions]
        if not names:
            raise ValueError(f"plan slot {self.name!r}: a plan needs an action; to empty it, clear")
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"plan slot {self.name!r}: two actions are called {name!r}")
            if "/" in name:
                raise ValueError(f"plan slot {self.name!r}: action name {name!r} contains '/'")
        for action in actions:
            if action.parent is not None:
                raise ValueError(
                    f"plan slot {self.name!r}: action {action.name!r} is already under "
                    f"{action.parent.name!r}; make new actions for every plan"
                )
        self.clear()
        self.add_children(list(actions))
        self._say(Code.PLAN_READY, f"a plan of {len(names)} actions is ready")

    def clear(self) -> None:
        """Terminate and remove every action.

        Raises:
            RuntimeError: called by one of the slot's own actions.
        """
        if self._ticking:
            raise RuntimeError(f"plan slot {self.name!r}: an action cannot replace its own plan")
        if self.status != Status.INVALID:
            self.stop(Status.INVALID)
        self.remove_all_children()
        self._say(Code.NO_PLAN, "there is no plan")

    def tick(self) -> Iterator[Behaviour]:
        """Carry on with the current action, or fail where there is no plan to carry out."""
        if self.needs_plan:
            code, message = self.code, self.feedback_message
            self.stop(Status.FAILURE)
            self._say(code, message)
            yield self
            return
        self._ticking = True
        try:
            for node in super().tick():
                step = self.step if node is self else None
                if step is not None:
                    action = f"step {step + 1} of {len(self.children)}"
                    self._say(Code.PLAN_RUNNING, f"{action}: {self.children[step].name}")
                yield node
        finally:
            self._ticking = False

    def terminate(self, new_status: Status) -> None:
        """Note how the plan ended; from now on it is spent."""
        last = self.feedback_message
        if new_status == Status.SUCCESS:
            self._say(Code.PLAN_FINISHED, f"all {len(self.children)} actions are done")
        elif new_status == Status.FAILURE:
            failed = next((c for c in self.children if c.status == Status.FAILURE), None)
            what = "" if failed is None else f" at {failed.name}: {failed.feedback_message}"
            self._say(Code.PLAN_FAILED, f"the plan failed{what}")
        elif self.status == Status.RUNNING:
            self._say(Code.PLAN_INTERRUPTED, f"the plan was interrupted ({last})")

    def _say(self, code: Code, message: str) -> None:
        self.code, self.feedback_message = code, message
