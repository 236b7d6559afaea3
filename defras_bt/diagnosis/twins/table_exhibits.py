"""What can be shown of diagnosed tables: force over stretch, a joint's error over where it was told
to be, a tip's deflection over the force on it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from defras_bt.diagnosis.diagnosis import Diagnosis
from defras_bt.diagnosis.exhibits import Comparison, Exhibits
from defras_bt.diagnosis.twins.arm import ArmProblem
from defras_bt.diagnosis.twins.arm_load import ArmLoadProblem
from defras_bt.diagnosis.twins.coupon import CouponProblem
from defras_bt.diagnosis.twins.table_problem import TableProblem
from defras_sim.effects.arm_joints import JOINTS
from defras_sim.geometry import Floats


def table_exhibits(problem: TableProblem, diagnosis: Diagnosis) -> Exhibits:
    """Measured beside predicted, in the curve that people of the field draw.

    Raises:
        TypeError: there is no such curve for this kind of problem.
    """
    plain, extended = problem.predicted(diagnosis.base), problem.predicted(diagnosis.model)
    if isinstance(problem, CouponProblem):
        return Exhibits(_pulls(problem, plain, extended))
    if isinstance(problem, ArmProblem):
        return Exhibits(_joints(problem, plain, extended))
    if isinstance(problem, ArmLoadProblem):
        return Exhibits(_pushes(problem, plain, extended))
    raise TypeError(f"nobody has said how to draw a {type(problem).__name__}")


def _pulls(problem: CouponProblem, plain: Floats, extended: Floats) -> tuple[Comparison, ...]:
    found = []
    for index, run in enumerate(problem.runs):
        rows = problem.samples.trajectory == index
        found.append(
            Comparison(
                run.name,
                "stretch",
                "",
                "force",
                "N",
                run.stretch,
                problem.measured[rows],
                plain[rows],
                extended[rows],
            )
        )
    return tuple(found)


def _joints(problem: ArmProblem, plain: Floats, extended: Floats) -> tuple[Comparison, ...]:
    """Errors: play makes a loop of them, a coupling a slope, a lag an ellipse."""
    found = []
    for index, channel in enumerate(problem.samples.channels):
        rows = problem.samples.channel == index
        told = _joined([run.setpoint[:, JOINTS.index(channel.name)] for run in problem.runs])
        measured, before, after = (
            _cut(values[rows], problem.samples.trajectory[rows]) - told
            for values in (problem.measured, plain, extended)
        )
        found.append(
            Comparison(
                channel.name,
                "told to be at",
                channel.unit,
                "error",
                channel.unit,
                told,
                measured,
                before,
                after,
            )
        )
    return tuple(found)


def _pushes(problem: ArmLoadProblem, plain: Floats, extended: Floats) -> tuple[Comparison, ...]:
    found = []
    for index, channel in enumerate(problem.samples.channels):
        rows = problem.samples.channel == index
        forces = [run.force_n for run in problem.runs if run.axis == channel.name]
        measured, before, after = (
            _cut(values[rows], problem.samples.trajectory[rows])
            for values in (problem.measured, plain, extended)
        )
        found.append(
            Comparison(
                f"pushes along {channel.name}, less their mean",
                "force",
                "N",
                "deflection",
                "m",
                _joined(forces),
                measured,
                before,
                after,
            )
        )
    return tuple(found)


def _joined(parts: Sequence[Floats]) -> Floats:
    """One after another, with NaN between."""
    gap = np.array([np.nan])
    return np.concatenate([piece for part in parts for piece in (part, gap)])


def _cut(values: Floats, trajectory: np.ndarray) -> Floats:
    """Values (n,) sorted by ``trajectory`` (n,), with NaN after each."""
    return _joined([values[trajectory == each] for each in np.unique(trajectory)])
