"""py_trees' inner nodes, tick for tick, without the log that nobody reads.

py_trees puts a line together for its log whenever a node is ticked or stopped, and throws it away
unless its log is on: with the formatting of statuses in it, that is a third of the time of a tick.
That these nodes do what py_trees' own do is tested on random trees.
"""

from __future__ import annotations

from collections.abc import Iterator

from py_trees import composites, decorators
from py_trees.behaviour import Behaviour
from py_trees.common import Status


class Sequence(composites.Sequence):
    """``reactive`` and, with ``memory``, ``sequence``."""

    status: Status

    def tick(self) -> Iterator[Behaviour]:
        """Tick the children in order until one does not succeed."""
        children, first = self.children, 0
        if self.status != Status.RUNNING:
            self.current_child = children[0] if children else None
            _stop_all(children)
            self.initialise()
        elif self.memory and self.current_child is not None:
            first = children.index(self.current_child)
        else:
            self.current_child = children[0] if children else None
        if not children:
            self.stop(Status.SUCCESS)
            yield self
            return
        for index in range(first, len(children)):
            child = self.current_child = children[index]
            yield from child.tick()
            if child.status != Status.SUCCESS:
                if not self.memory:
                    _stop_all(children[index + 1 :])
                if child.status == Status.RUNNING:
                    self.status = Status.RUNNING
                else:
                    self.stop(child.status)
                yield self
                return
        self.stop(Status.SUCCESS)
        yield self

    def stop(self, new_status: Status = Status.INVALID) -> None:
        """End the activity of this node and, if it is INVALID, of those under it."""
        composites.Composite.stop(self, new_status)


class Selector(composites.Selector):
    """``reactive_selector`` and, with ``memory``, ``selector``."""

    status: Status

    def tick(self) -> Iterator[Behaviour]:
        """Tick the children in order until one does not fail."""
        children, first = self.children, 0
        if self.status != Status.RUNNING:
            self.current_child = children[0] if children else None
            self.initialise()
        if not children:
            self.current_child = None
            self.stop(Status.FAILURE)
            yield self
            return
        if self.memory and self.current_child is not None:
            first = children.index(self.current_child)
            _stop_all(children[:first])
        previous = self.current_child
        for index in range(first, len(children)):
            child = children[index]
            yield from child.tick()
            if child.status in (Status.RUNNING, Status.SUCCESS):
                self.current_child = child
                if previous is not child:
                    _stop_all(children[index + 1 :])
                if child.status == Status.RUNNING:
                    self.status = Status.RUNNING
                else:
                    self.stop(Status.SUCCESS)
                yield self
                return
        self.stop(Status.FAILURE)
        self.current_child = children[-1]
        yield self

    def stop(self, new_status: Status = Status.INVALID) -> None:
        """End the activity of this node and, if it is INVALID, of those under it."""
        composites.Composite.stop(self, new_status)


class _Decorator(decorators.Decorator):
    """Asks its child every time and shows another status for the one it gets."""

    status: Status

    def tick(self) -> Iterator[Behaviour]:
        """Tick the child, then show what :meth:`update` makes of it."""
        if self.status != Status.RUNNING:
            self.initialise()
        yield from self.decorated.tick()
        status = self.update()
        if status != Status.RUNNING:
            self.stop(status)
        self.status = status
        yield self

    def stop(self, new_status: Status) -> None:
        """End the activity of this node, and of its child unless that has ended already."""
        self.terminate(new_status)
        if new_status == Status.INVALID:
            self.decorated.stop(new_status)
        if self.decorated.status == Status.RUNNING:
            self.decorated.stop(Status.INVALID)
        self.status = new_status


class Inverter(_Decorator, decorators.Inverter):
    """``invert``."""


class FailureIsSuccess(_Decorator, decorators.FailureIsSuccess):
    """``ignore_failure``."""


def _stop_all(behaviours: list[Behaviour]) -> None:
    for behaviour in behaviours:
        if behaviour.status != Status.INVALID:
            behaviour.stop(Status.INVALID)
