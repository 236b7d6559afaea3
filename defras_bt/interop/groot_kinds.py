"""Which node of BehaviorTree.CPP 4 does what each inner node of a tree file does.

Only those that show the same status for the same answers in every tick stand here, as the sources
of version 4 have them. The rest goes under names of its own, so that nobody runs a tree that
looks the same and does something else.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from defras_bt.executive.tree_kinds import KINDS

SAME: Mapping[str, str] = MappingProxyType(
    {
        "reactive": "ReactiveSequence",
        "sequence": "Sequence",
        "reactive_selector": "ReactiveFallback",
        "selector": "Fallback",
        "invert": "Inverter",
        "ignore_failure": "ForceSuccess",
        "success_is_failure": "ForceFailure",
        "success_is_running": "KeepRunningUntilFailure",
    }
)

_LOOPS = "it starts its child again within the same tick, here that waits for the next"
OTHER: Mapping[str, str] = MappingProxyType(
    {
        "Parallel": "it does not look again at a child that is done, here every child is ticked",
        "ParallelAll": "it does not look again at a child that is done",
        "RetryUntilSuccessful": _LOOPS,
        "Repeat": _LOOPS,
        "LoopInt": _LOOPS,
        "Timeout": "it reads the system clock, here time is counted in ticks of the world",
        "Delay": "it reads the system clock, here time is counted in ticks of the world",
        "Sleep": "it reads the system clock, here time is counted in ticks of the world",
        "RunOnce": "it skips, which no node can here",
        "SequenceWithMemory": "it goes on at the child that failed, here a sequence starts anew",
        "SequenceStar": "it goes on at the child that failed, here a sequence starts anew",
        "AsyncSequence": "it returns RUNNING between its children",
        "AsyncFallback": "it returns RUNNING between its children",
        "IfThenElse": "there is no such node here; write a reactive_selector",
        "WhileDoElse": "there is no such node here; write a reactive_selector",
        "Switch2": "there is no such node here; write a reactive_selector",
        "Switch3": "there is no such node here; write a reactive_selector",
        "ManualSelector": "there is no such node here",
        "Script": "trees hold no scripts here; write a leaf",
        "ScriptCondition": "trees hold no scripts here; write a leaf",
        "Precondition": "trees hold no scripts here; write a guard",
        "SetBlackboard": "ports are written by leaves here",
        "UnsetBlackboard": "ports are written by leaves here",
        "AlwaysSuccess": "there is no such node here",
        "AlwaysFailure": "there is no such node here",
        "ConsumeQueue": "there is no such node here",
        "EntryUpdatedDecorator": "there is no such node here",
        "SkipUnlessUpdated": "it skips, which no node can here",
        "WaitValueUpdate": "there is no such node here",
    }
)
"""Nodes of BehaviorTree.CPP that would not mean the same, and why."""


def groot_id(kind: str) -> str:
    """What a node of this kind is called in XML; a leaf keeps its name.

    >>> groot_id("selector"), groot_id("plan_slot"), groot_id("Replan")
    ('Fallback', 'DefrasPlanSlot', 'Replan')
    """
    if kind in SAME:
        return SAME[kind]
    if kind not in KINDS:
        return kind
    return "Defras" + "".join(part.capitalize() for part in kind.split("_"))


def kind_of_id(identifier: str) -> str:
    """The reverse of :func:`groot_id`; what is no kind is taken for a leaf."""
    return _KINDS_BY_ID.get(identifier, identifier)


_KINDS_BY_ID = {groot_id(kind): kind for kind in KINDS}
