"""One tick of a tree as recorded: what every node last said, and who decided."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from defras_bt.recording.record import Cause, Event, TickRecord
from defras_bt.recording.tree_layout import parent_of


@dataclass(frozen=True)
class NodeWord:
    """The last words of a node.

    ``status`` is the last one it had; ``ticked`` says whether that was in this very tick, so that
    RUNNING without it means pre-empted. ``decider`` is the name of the child that decided an inner
    node; ``code`` and ``message`` are then that child's.
    """

    ticked: bool
    status: str
    code: str
    message: str
    decider: str | None = None


@dataclass(frozen=True)
class Moment:
    """``nodes`` by path; those never ticked are not there.

    ``kinds``: kind of each node by path, in the order of the tree; leaves made from a plan are not
    in it. The rest is as in a TickRecord.
    """

    tick: int
    time_s: float
    nodes: Mapping[str, NodeWord]
    kinds: Mapping[str, str]
    cause: Cause | None
    stopped_by: Cause | None
    ended: Cause | None
    operator: str
    events: tuple[Event, ...] = field(default=())

    @property
    def root(self) -> str | None:
        """Path of the root; None where the tree was never ticked."""
        return next((path for path in self.nodes if parent_of(path) is None), None)

    def children(self, path: str) -> list[str]:
        """Paths of the children of ``path`` that were ever ticked, in the order of the tree."""
        order = {known: position for position, known in enumerate(self.kinds)}
        found = [child for child in self.nodes if parent_of(child) == path]
        return sorted(found, key=lambda child: order.get(child, len(order)))


def moment_of(record: TickRecord, kinds: Mapping[str, str]) -> Moment:
    """The moment of a tick; ``kinds`` as in :class:`Moment`."""
    return Moment(
        tick=record.tick,
        time_s=record.time_s,
        nodes=node_words(record),
        kinds=kinds,
        cause=record.cause,
        stopped_by=record.stopped_by,
        ended=record.ended,
        operator=record.operator.mode.value,
        events=record.events,
    )


def node_words(record: TickRecord) -> dict[str, NodeWord]:
    """The words of every node that was ever ticked, by path."""
    words = {}
    for path, ticked in record.node_status.items():
        status = record.node_last_status.get(path, ticked)
        if status:
            decider = record.node_decider.get(path)
            words[path] = NodeWord(
                bool(ticked),
                status,
                record.node_code.get(path, ""),
                record.node_message.get(path, ""),
                decider.rpartition("/")[2] if decider else None,
            )
    return words
