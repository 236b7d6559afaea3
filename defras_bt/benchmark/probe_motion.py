"""The last bit of motion before attachments are learned again: a tug, or as much of the plan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np

from defras_bt.acting.manoeuvre import SETTLE_S
from defras_bt.benchmark.attachment_driver import REACHED_M, Asked, Driver
from defras_bt.learning.probe.choice import Tug
from defras_sim.geometry import Floats

SLOWER = 0.5
"""Of planned speed, as the tree's node tugs."""


@dataclass(frozen=True)
class Moved:
    """What is known after a motion, and the largest true grasp force [N] on the way."""

    asked: Asked
    force_most_n: float


def tugged(driver: Driver, tug: Tug) -> Moved | None:
    """Tug as the tree's node does and let the tissue settle; None where model or grasp fail."""
    return _led(driver, [driver.tip_m + tug.way_m], SLOWER, _ticks(driver, tug))


def gone_on(driver: Driver, tug: Tug) -> tuple[Moved | None, Moved | None]:
    """Go on as planned by the length of ``tug``, as slowly and for as long: only where to differs.

    Where less of the plan is left the arm then holds still. Second is the end of the whole plan.
    """
    length_m = float(np.linalg.norm(tug.way_m))
    now_m, later_m = divided(driver.tip_m, driver.planned_m, length_m)
    moved = _led(driver, now_m, SLOWER, _ticks(driver, tug))
    return moved, None if moved is None else _ended(driver, later_m)


def divided(
    start_m: Floats, targets_m: Sequence[Floats], length_m: float
) -> tuple[list[Floats], list[Floats]]:
    """The first ``length_m`` of the way from ``start_m`` (3,) over ``targets_m`` (each (3,)), and
    the rest, as targets."""
    first: list[Floats] = []
    left_m = length_m
    for number, target_m in enumerate(targets_m):
        way_m = target_m - start_m
        distance_m = float(np.linalg.norm(way_m))
        if distance_m > left_m:
            return [*first, start_m + way_m * (left_m / distance_m)], list(targets_m[number:])
        first.append(target_m)
        start_m, left_m = target_m, left_m - distance_m
    return first, []


def _ended(driver: Driver, targets_m: Sequence[Floats]) -> Moved | None:
    """Over ``targets_m`` at planned speed."""
    way_m = np.diff(np.array([driver.tip_m, *targets_m]), axis=0)
    length_m = float(np.linalg.norm(way_m, axis=1).sum())
    speed_m_s = driver.scene.motion.tissue_speed_m_s
    # No tick goes round a corner.
    ticks = ceil((length_m / speed_m_s + SETTLE_S) / driver.tick_s) + len(targets_m)
    return _led(driver, targets_m, 1.0, ticks)


def _ticks(driver: Driver, tug: Tug) -> int:
    speed_m_s = SLOWER * driver.scene.motion.tissue_speed_m_s
    return ceil((float(np.linalg.norm(tug.way_m)) / speed_m_s + SETTLE_S) / driver.tick_s)


def _led(
    driver: Driver, targets_m: Sequence[Floats], share_of_speed: float, ticks: int
) -> Moved | None:
    """Over ``targets_m`` (each (3,)) in ``ticks``, at the end holding still."""
    left = list(targets_m)
    most_n = 0.0
    for _ in range(ticks):
        while left and np.linalg.norm(left[0] - driver.tip_m) < REACHED_M:
            left.pop(0)
        way_m = left[0] - driver.tip_m if left else np.zeros(3)
        if not driver.go(way_m, share_of_speed * driver.scene.motion.tissue_speed_m_s):
            return None
        if not driver.holds:
            return None
        force_n = driver.true_force_n
        most_n = max(most_n, 0.0 if force_n is None else force_n)
    asked = driver.asked()
    return None if asked is None else Moved(asked, most_n)
