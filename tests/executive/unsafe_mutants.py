"""Unsafe changes of a tree, made by code, each with a name and the claims that it may break."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from defras_bt.executive.tree_kinds import KINDS
from defras_bt.executive.tree_spec import NodeSpec, TreeSpec

Change = Callable[[NodeSpec], NodeSpec]


def changed(root: NodeSpec, path: str, change: Change, above: str = "") -> NodeSpec:
    """The tree with ``change`` made to the node at ``path``, which has to be there."""
    here = f"{above}{root.name}"
    if here == path:
        return change(root)
    index = next(
        (i for i, c in enumerate(root.children) if f"{path}/".startswith(f"{here}/{c.name}/")), None
    )
    if index is None:
        raise LookupError(f"nothing at {path}")
    child = changed(root.children[index], path, change, f"{here}/")
    return replace(root, children=(*root.children[:index], child, *root.children[index + 1 :]))


def into(kind: str, **options: Any) -> Change:
    """Another kind of composite over the same children."""
    made = KINDS[kind].options(**options)
    return lambda spec: replace(spec, kind=kind, options=made)


def under(kind: str, **options: Any) -> Change:
    """A decorator put around a node."""
    made = KINDS[kind].options(**options)
    return lambda spec: NodeSpec(kind, f"{kind}_{spec.name}", spec.place, made, (spec,))


def without(name: str) -> Change:
    """A node without its child of this name."""

    def change(spec: NodeSpec) -> NodeSpec:
        kept = tuple(child for child in spec.children if child.name != name)
        assert len(kept) == len(spec.children) - 1
        return replace(spec, children=kept)

    return change


def first(name: str) -> Change:
    """A node with its child of this name before all others."""

    def change(spec: NodeSpec) -> NodeSpec:
        (moved,) = (child for child in spec.children if child.name == name)
        return replace(spec, children=(moved, *(c for c in spec.children if c is not moved)))

    return change


def with_parameters(**parameters: Any) -> Change:
    """A leaf with other parameters."""
    return lambda spec: replace(spec, options=spec.options.model_copy(update=parameters))


def beside_each_other(spec: NodeSpec) -> NodeSpec:
    """The guards of a node in a sequence of their own, before what they guard."""
    made = KINDS["sequence"].options()
    guards = NodeSpec("sequence", "guards", spec.place, made, spec.children[:-1])
    return replace(spec, children=(guards, spec.children[-1]))


def alternatives(spec: NodeSpec) -> NodeSpec:
    """A node whose guards are tried one after the other until one succeeds."""
    guards = tuple(c for c in spec.children if c.node_class and c.node_class.role == "guard")
    others = tuple(child for child in spec.children if child not in guards)
    made = KINDS["reactive_selector"].options()
    choice = NodeSpec("reactive_selector", "guards", spec.place, made, guards)
    return replace(spec, children=(choice, *others))


OPERATE, RECOVER = "defras/operate", "defras/recover"

DEFRAS_MUTANTS: dict[str, tuple[str, Change]] = {
    "guards are not looked at again": (OPERATE, into("sequence")),
    "guards are in a sequence of their own": (OPERATE, beside_each_other),
    "guards run beside the plan": (OPERATE, into("parallel", succeed_when="all")),
    "guards that succeeded are skipped": (
        OPERATE,
        into("parallel", succeed_when="all", synchronise=True),
    ),
    "one guard of many is enough": (OPERATE, into("parallel", succeed_when="one")),
    "guards are alternatives": (OPERATE, alternatives),
    "the plan comes before its guards": (OPERATE, first("act")),
    "the force guard may fail": (f"{OPERATE}/force_accepted", under("ignore_failure")),
    "the force guard is inverted": (f"{OPERATE}/force_accepted", under("invert")),
    "the sensors are looked at once": (f"{OPERATE}/sensors_fresh", under("once")),
    "a failed guard counts as waiting": (
        f"{OPERATE}/operator_permits",
        under("running_is_success"),
    ),
    "a failed warning counts as running on": (
        f"{OPERATE}/warning_below",
        lambda spec: under("running_is_success")(under("failure_is_running")(spec)),
    ),
    "no look at the sensors": (OPERATE, without("sensors_fresh")),
    "no look at the force": (OPERATE, without("force_accepted")),
    "no look at the warning state": (OPERATE, without("warning_below")),
    "warning state 2 is let pass": (f"{OPERATE}/warning_below", with_parameters(state=3)),
    "the force may be too high for ten seconds": (
        f"{OPERATE}/force_accepted",
        with_parameters(patience_s=10.0),
    ),
    "no human at warning state 3": ("defras/human/needed", without("lost")),
    "no human when the operator stops": ("defras", without("human")),
    "a running branch keeps its turn": ("defras", into("selector")),
    "recovery before the human": ("defras", first("recover")),
    "jaws open without a look at the sensors": (
        f"{RECOVER}/give_up_grip/let_go",
        without("sensors_fresh"),
    ),
    "letting go is not interrupted": (f"{RECOVER}/give_up_grip/let_go", into("sequence")),
    "everything beside everything": ("defras", into("parallel", succeed_when="one")),
    "the human is asked beside the rest": ("defras/human", under("success_is_failure")),
}
"""Name, path and change of each."""


def mutant(tree: TreeSpec, name: str) -> TreeSpec:
    """``tree``, which is trees/defras.yaml, with one change."""
    path, change = DEFRAS_MUTANTS[name]
    return replace(tree, root=changed(tree.root, path, change))
