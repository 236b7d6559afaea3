"""The decorator that ends what takes too long, counted in ticks of world time."""

from __future__ import annotations

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.decorators import Decorator


class TimeOut(Decorator):
    """Fails in the tick in which its child has run for ``ticks`` ticks without an answer.

    py_trees' own Timeout reads the clock of the computer: it would go on counting while the world
    is paused, and a replay would end elsewhere than the run. This one counts its own ticks, each of
    them ``Scene.tick_s`` of world time.
    """

    def __init__(self, name: str, child: Behaviour, ticks: int) -> None:
        super().__init__(name, child)
        self.ticks = ticks
        self._run = 0

    def initialise(self) -> None:
        """Count anew whenever the child is started anew."""
        self._run = 0

    def update(self) -> Status:
        """What the child shows, or FAILURE once its time is over."""
        child = self.decorated
        if child.status != Status.RUNNING:
            self.feedback_message = child.feedback_message
            return child.status
        self._run += 1
        if self._run < self.ticks:
            self.feedback_message = f"running since {self._run} of {self.ticks} ticks"
            return Status.RUNNING
        self.feedback_message = f"no answer within {self.ticks} ticks"
        return Status.FAILURE
