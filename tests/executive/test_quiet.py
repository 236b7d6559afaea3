"""The quiet inner nodes do what py_trees' own do, tick for tick."""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import dataclass, field
from types import SimpleNamespace

import pytest
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from defras_bt.benchmark.bare_tree import bare
from defras_bt.executive import quiet
from defras_bt.executive.loader import walk
from defras_bt.executive.tree_kinds import KINDS
from defras_bt.executive.tree_spec import NodeSpec
from tests.executive.random_trees import random_spec

TREES, TICKS = 400, 12
ANSWERS = (Status.SUCCESS, Status.FAILURE, Status.RUNNING)
KINDS_DRAWN = (
    *["reactive", "sequence", "reactive_selector", "selector"] * 3,
    *("invert", "ignore_failure", "parallel", "retry", "repeat", "time_out", "once"),
)


@dataclass
class Stage:
    """Where leaves are told what to say, and say what happened to them."""

    answers: random.Random
    events: list[tuple[str, ...]] = field(default_factory=list)


class Leaf(Behaviour):
    """Answers at random, and notes all that is done to it."""

    def __init__(self, name: str, stage: Stage) -> None:
        super().__init__(name)
        self.stage = stage

    def initialise(self) -> None:
        self.stage.events.append((self.name, "initialise"))

    def update(self) -> Status:
        answer = self.stage.answers.choice(ANSWERS)
        self.stage.events.append((self.name, answer.name))
        return answer

    def terminate(self, new_status: Status) -> None:
        self.stage.events.append((self.name, "terminate", self.status.name, new_status.name))


def quietly(spec: NodeSpec, stage: Stage) -> Behaviour:
    """The tree that a tree file makes."""
    if spec.node_class is not None:
        return Leaf(spec.name, stage)
    return KINDS[spec.kind].build(
        spec.name, spec.options, [quietly(c, stage) for c in spec.children]
    )


def seen(root: Behaviour) -> Iterator[tuple[str, str, str]]:
    """Path, status and current child of every node."""
    for node, path in walk(root):
        current = getattr(node, "current_child", None)
        yield path, node.status.name, "" if current is None else current.name


@pytest.mark.parametrize("batch", range(4))
def test_random_trees_go_the_same_way(toys: SimpleNamespace, batch: int) -> None:
    chance = random.Random(batch)
    for _ in range(TREES // 4):
        spec = random_spec(toys.registry, chance, inner=KINDS_DRAWN)
        seed = chance.random()
        stages = Stage(random.Random(seed)), Stage(random.Random(seed))
        ours = quietly(spec, stages[0])
        theirs = bare(spec, lambda leaf, stage=stages[1]: Leaf(leaf.name, stage))
        for _ in range(TICKS):
            order = [[node.name for node in root.tick()] for root in (ours, theirs)]
            assert order[0] == order[1]
            assert stages[0].events == stages[1].events
            assert list(seen(ours)) == list(seen(theirs))
            if chance.random() < 0.15:
                for root in (ours, theirs):
                    root.stop(Status.INVALID)


def test_trees_are_made_of_them() -> None:
    def made(kind: str) -> Behaviour:
        children: list[Behaviour] = [Leaf("leaf", Stage(random.Random(0)))]
        return KINDS[kind].build(kind, KINDS[kind].options(), children)

    for kind in ("reactive", "sequence", "reactive_selector", "selector", "invert"):
        assert type(made(kind)).__module__ == quiet.__name__
