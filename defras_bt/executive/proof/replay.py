"""Examples that clingo found, carried out by py_trees itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from defras_bt.executive.composites import PlanSlot
from defras_bt.executive.loader import walk
from defras_bt.executive.proof.facts import Numbered
from defras_bt.executive.proof.trace import Trace
from defras_bt.executive.tree_kinds import KINDS


class NotReproduced(RuntimeError):
    """py_trees did otherwise than clingo said: asp/tree_semantics.lp is wrong, not the tree."""


class _StandIn(Behaviour):
    """A leaf that answers as the example says."""

    def __init__(self, name: str, answer: Callable[[], Status]) -> None:
        super().__init__(name)
        self._answer = answer

    def update(self) -> Status:
        return self._answer()


def replay(trace: Trace) -> None:
    """Carry out the ticks of ``trace``, which starts with the tree's first tick.

    Raises:
        NotReproduced: some node showed another status than ``trace`` says.
    """
    answers: Mapping[str, Status] = {}

    def stand_in(node: Numbered) -> _StandIn:
        name = node.path.rpartition("/")[2]
        return _StandIn(name, lambda: answers[node.path])

    def build(node: Numbered) -> Behaviour:
        if node.spec is None or node.spec.node_class is not None:
            return stand_in(node)
        children = [] if node.is_slot else [build(child) for child in node.children]
        return KINDS[node.spec.kind].build(node.spec.name, node.spec.options, children)

    root = build(trace.root)
    slots = {node.path: node for node in trace.root.walk() if node.is_slot}
    for number, tick in enumerate(trace.ticks, 1):
        answers = tick.shown
        if tick.new_plan:
            for behaviour, path in list(walk(root)):
                if isinstance(behaviour, PlanSlot):
                    behaviour.fill([stand_in(action) for action in slots[path].children])
        root.tick_once()
        for behaviour, path in walk(root):
            if behaviour.status != tick.after[path]:
                raise NotReproduced(
                    f"tick {number}: {path} is {behaviour.status} in py_trees, but "
                    f"{tick.after[path]} in asp/tree_semantics.lp; please report this tree"
                )
