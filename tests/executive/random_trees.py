"""Random trees of every kind of node, as they are after reading a file."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from defras_bt.executive.node import NoParameters
from defras_bt.executive.registry import Registry
from defras_bt.executive.tree_kinds import KINDS
from defras_bt.executive.tree_spec import NodeSpec

INNER = tuple(kind.name for kind in KINDS.values() if kind.holds)
NOWHERE = ("tree.yaml", 1, 1)


def random_options(kind: str, chance: random.Random, children: Sequence[str]) -> dict[str, Any]:
    """Options that ``kind`` accepts over children of these names."""
    if kind == "parallel":
        some = tuple(chance.sample(children, chance.randint(1, len(children))))
        wanted = chance.choice(["all", "one", some])
        return {
            "succeed_when": wanted,
            "synchronise": wanted != "one" and chance.random() < 0.5,
        }
    choices: Mapping[str, Callable[[], dict[str, Any]]] = {
        "retry": lambda: {"attempts": chance.randint(1, 3)},
        "repeat": lambda: {"times": chance.randint(1, 3)},
        "time_out": lambda: {"ticks": chance.randint(1, 3)},
        "once": lambda: {"until": chance.choice(["success", "completion"])},
        "wait_for": lambda: {"status": chance.choice(["success", "failure"])},
    }
    return choices[kind]() if kind in choices else {}


def spec_of(
    registry: Registry,
    kind: str,
    children: Sequence[NodeSpec] = (),
    name: str | None = None,
    **options: Any,
) -> NodeSpec:
    """A node of ``kind``, an inner one or a registered leaf."""
    leaf = registry.nodes().get(kind)
    made = NoParameters() if leaf else KINDS[kind].options(**options)
    return NodeSpec(kind, name or kind.lower(), NOWHERE, made, tuple(children), leaf)


def random_spec(
    registry: Registry,
    chance: random.Random,
    *,
    inner: Sequence[str] = INNER,
    leaves: Sequence[str] = ("Watch", "Watch", "Push", "Think"),
    most_children: int = 4,
    deepest: int = 4,
    guard_first: float = 0.0,
    name: str = "n",
) -> NodeSpec:
    """A tree whose nodes are called by their place: "n", "n0", "n01" and so on.

    ``guard_first``: how often a ``reactive`` is given a Watch before its other children.
    """
    if deepest == 0 or (len(name) > 1 and chance.random() < 0.4):
        return spec_of(registry, chance.choice(leaves), name=name)
    kind = chance.choice(inner)
    amount = chance.randint(1, most_children) if KINDS[kind].holds == "children" else 1
    children = [
        random_spec(
            registry,
            chance,
            inner=inner,
            leaves=leaves,
            most_children=most_children,
            deepest=deepest - 1,
            guard_first=guard_first,
            name=f"{name}{index}",
        )
        for index in range(amount)
    ]
    if kind == "reactive" and chance.random() < guard_first:
        children.insert(0, spec_of(registry, "Watch", name=f"{name}g"))
    options = random_options(kind, chance, [child.name for child in children])
    return spec_of(registry, kind, children, name, **options)
