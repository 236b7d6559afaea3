"""What all action leaves share: one arm, one grasp point, motion towards a target."""

from __future__ import annotations

from math import hypot
from typing import ClassVar, Literal

from py_trees.common import Status

from defras_bt.executive.node import Node, NodeParameters, Role
from defras_bt.executive.reasons import Code
from defras_bt.planning.plan import GridPoint
from defras_sim.geometry import Floats
from defras_sim.scene import ArmName
from defras_sim.worlds.protocol import ArmCommand, ArmObservation

ARRIVED_M = 2e-4


def arriving_m_s(distance_m: float, speed_m_s: float, tick_s: float, *, goal_ahead: bool) -> float:
    """The speed that ends at a target: there with the tick where set-points arrive with it.

    ``goal_ahead``: set-points run behind their goal, the less the slower they go, and stay where
    they are when motion ends. So the last way is halved tick by tick, and little is left of it.
    """
    ticks = 2.0 if goal_ahead else 1.0
    return min(speed_m_s, distance_m / (ticks * tick_s))


class ActionParameters(NodeParameters):
    """Which arm acts, and on which grasp point (column, row)."""

    arm: ArmName
    point: tuple[int, int]


class ArmAction(Node):
    """Base of the action leaves that plans are made of. Time is world time that was watched."""

    role: ClassVar[Role] = "motion"
    Parameters = ActionParameters
    parameters: ActionParameters
    spoken: ClassVar[Literal["reach", "open", "grasp", "pull", "move", "fold", "release"]]

    def initialise(self) -> None:
        self._started_s = self.context.board.watched_s

    @property
    def arm(self) -> str:
        return self.parameters.arm

    @property
    def point(self) -> GridPoint:
        return self.parameters.point

    @property
    def observed(self) -> ArmObservation:
        return self.context.board.inputs.observation.arms[self.arm]

    @property
    def setpoint_m(self) -> Floats:
        """Where the tip was last told to be (3,), tissue frame."""
        return self.observed.commanded_tissue_from_tip.position_m

    @property
    def elapsed_s(self) -> float:
        return self.context.board.watched_s - self._started_s

    @property
    def who(self) -> str:
        return self.arm.upper()

    def go(self, target_m: Floats, speed_m_s: float) -> bool:
        """Propose motion straight to ``target_m``; True once the set-point is there."""
        way = target_m - self.setpoint_m
        distance = hypot(*way.tolist())
        if distance <= ARRIVED_M:
            return True
        ahead = self.observed.goal_tissue_from_tip is not None
        speed = arriving_m_s(distance, speed_m_s, self.context.scene.tick_s, goal_ahead=ahead)
        self.context.board.move(self.arm, ArmCommand(linear_m_s=way * (speed / distance)))
        return False

    def finish(self, message: str) -> Status:
        """Report success; the event told here is what counts as one action."""
        board = self.context.board
        board.tell("action", message, data={"action": self.spoken, "arm": self.arm})
        return self.succeed(Code.DONE, message)
