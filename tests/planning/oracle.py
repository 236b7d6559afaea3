"""The retraction task read again in plain Python, without clingo: preconditions, effects, goal."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from defras_bt.planning.plan import Action, GridPoint, Situation
from defras_sim.scene import Scene

APART_M = 0.020


@dataclass(frozen=True)
class OracleArm:
    at: GridPoint | None
    holding: GridPoint | None
    jaw_open: bool
    done: frozenset[str]


State = tuple[tuple[str, OracleArm], ...]
Step = tuple[str, str, GridPoint]


def start_of(situation: Situation) -> State:
    return tuple(
        (
            name,
            OracleArm(
                at=arm.holding or arm.at,
                holding=arm.holding,
                jaw_open=arm.jaw_open,
                done=frozenset(arm.done) if arm.holding else frozenset(),
            ),
        )
        for name, arm in sorted(situation.arms.items())
    )


class Oracle:
    """One scene and what is blocked."""

    def __init__(self, scene: Scene, blocked: frozenset[GridPoint]) -> None:
        grid = scene.grasp
        self.blocked = blocked
        self.place = {
            (c, r): scene.grasp_xy_m(c, r)
            for c in range(1, grid.columns + 1)
            for r in range(1, grid.rows + 1)
        }
        self.sign = {name: 1 if arm.side == "+y" else -1 for name, arm in scene.arms.items()}

    def steps(self, state: State) -> Iterator[Step]:
        arms = dict(state)
        for name, arm in state:
            others = [other for n, other in arms.items() if n != name]
            if arm.holding is None:
                for point in self.place:
                    if self._may_reach(name, arm, others, point):
                        yield "reach", name, point
                if arm.at is not None and arm.at not in self.blocked:
                    yield ("grasp" if arm.jaw_open else "open"), name, arm.at
                continue
            yield "release", name, arm.holding
            if arm.holding in self.blocked or any(other.holding for other in others):
                continue
            if "pull" not in arm.done:
                yield "pull", name, arm.holding
                continue
            if not arm.done & {"move", "fold"}:
                yield "move", name, arm.holding
            if "fold" not in arm.done:
                yield "fold", name, arm.holding

    def _may_reach(
        self, name: str, arm: OracleArm, others: list[OracleArm], point: GridPoint
    ) -> bool:
        on_side = self.place[point][1] * self.sign[name] >= -1e-9
        free = point not in self.blocked and arm.at != point
        clear = all(
            other.at != point
            and (
                other.holding is None
                or np.linalg.norm(self.place[point] - self.place[other.holding]) >= APART_M
            )
            for other in others
        )
        return bool(on_side and free and clear)

    def after(self, state: State, step: Step) -> State:
        action, name, point = step
        arm = dict(state)[name]
        if action == "reach":
            arm = replace(arm, at=point)
        elif action == "open":
            arm = replace(arm, jaw_open=True)
        elif action == "grasp":
            arm = OracleArm(at=point, holding=point, jaw_open=False, done=frozenset())
        elif action == "release":
            arm = OracleArm(at=None, holding=None, jaw_open=True, done=frozenset())
        else:
            arm = replace(arm, done=arm.done | {action})
        return tuple((n, arm if n == name else other) for n, other in state)

    def exposed_at(self, state: State, exposing: tuple[str, ...]) -> GridPoint | None:
        holding = [arm for _, arm in state if arm.holding is not None]
        if len(holding) != 1 or holding[0].holding in self.blocked:
            return None
        return holding[0].holding if set(exposing) <= holding[0].done else None

    def shortest(
        self, situation: Situation, required: GridPoint | None
    ) -> tuple[int, set[GridPoint]] | None:
        """Length of the shortest plans and all points they can end at; None without a plan."""
        start = start_of(situation)
        depth, queue = {start: 0}, deque([start])
        length, ends = None, set()
        while queue:
            state = queue.popleft()
            if length is not None and depth[state] > length:
                break
            point = self.exposed_at(state, situation.exposing)
            if point is not None and required in (None, point):
                length = depth[state]
                ends.add(point)
            for step in self.steps(state):
                ahead = self.after(state, step)
                if ahead not in depth:
                    depth[ahead] = depth[state] + 1
                    queue.append(ahead)
        return None if length is None else (length, ends)

    def replay(self, situation: Situation, actions: tuple[Action, ...]) -> State:
        """The state after ``actions``; fails on the first one that is not possible."""
        state = start_of(situation)
        for time, action in enumerate(actions, start=1):
            assert action.time == time
            assert action.point is not None
            step = (action.name, action.arm, action.point)
            assert step in set(self.steps(state)), f"{action} is not possible in {state}"
            state = self.after(state, step)
        return state
