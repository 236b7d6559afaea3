"""What must hold of a tree as a whole: above all, that a guard stands before every motion."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from defras_bt.executive.tree_kinds import ParallelOptions
from defras_bt.executive.tree_spec import NodeSpec
from defras_sim.yaml_source import Fault


def check_tree(
    root: NodeSpec, guard_names: Collection[str], *, must_be_guarded: bool = True
) -> Iterator[Fault]:
    """Faults of a tree whose nodes are each well-formed.

    ``guard_names``: classes that could be put before an unguarded motion, for the message.
    """
    if must_be_guarded:
        yield from _unguarded(root, False, guard_names)
    slots = [(path, spec) for path, spec in root.walk() if spec.kind == "plan_slot"]
    for path, spec in slots[1:]:
        yield Fault(
            *spec.place,
            f"a second plan_slot ({path}): a tree carries out one plan, at {slots[0][0]}",
        )


def moves(spec: NodeSpec) -> bool:
    """Whether the node itself commands an arm: a motion leaf, or the place for a plan's actions."""
    if spec.node_class is None:
        return spec.kind == "plan_slot"
    return spec.node_class.role == "motion"


def guards(spec: NodeSpec) -> bool:
    """Whether ``spec`` succeeds only in a tick in which a guard leaf under it succeeded.

    Not so for ``sequence`` and a synchronised parallel (they do not look at a finished guard
    again), a parallel that does not need the guard's success, and decorators: an inverted guard
    would let motion pass on missing data.
    """
    if spec.node_class is not None:
        return spec.node_class.role == "guard"
    if spec.kind == "reactive":
        return any(map(guards, spec.children))
    if isinstance(spec.options, ParallelOptions):
        wanted = spec.options.succeed_when
        needed = [child for child in spec.children if wanted == "all" or child.name in wanted]
        return wanted != "one" and not spec.options.synchronise and any(map(guards, needed))
    if spec.kind in ("selector", "reactive_selector"):
        return all(map(guards, spec.children))
    return False


def _unguarded(spec: NodeSpec, guarded: bool, guard_names: Collection[str]) -> Iterator[Fault]:
    """Faults for what moves at or under ``spec``; ``guarded``: a guard stands before ``spec``."""
    if moves(spec) and not guarded:
        examples = ", ".join(sorted(guard_names)) or "none is registered"
        yield Fault(
            *spec.place,
            f"{spec.kind} {spec.name!r} moves an arm and no guard stands before it; put it under a "
            f"`reactive`, after a guard ({examples})",
        )
    for index, child in enumerate(spec.children):
        before = spec.children[:index] if spec.kind == "reactive" else ()
        yield from _unguarded(child, guarded or any(map(guards, before)), guard_names)
