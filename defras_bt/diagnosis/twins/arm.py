"""The arm as a problem: joints it was told beside joints it was seen at.

Tables with ``time_s``, ``q1_setpoint_rad`` ... ``q6_setpoint_rad`` (``q3_setpoint_m``) and some of
``q1_measured_rad`` ...; ``q5_measured_sd_rad`` where the scatter of the readings is known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from defras_bt.diagnosis.problem import Candidate, Channel, Covariate, Samples
from defras_bt.diagnosis.quality import DataFault, DataQuality
from defras_bt.diagnosis.tables import Table
from defras_bt.diagnosis.tables_quality import (
    measured_rows,
    quality,
    rows_in_time,
    scatter,
    suspected_unit,
)
from defras_bt.diagnosis.twins.arm_candidates import joint_candidates, lag_starts, play_starts
from defras_bt.diagnosis.twins.table_problem import TableProblem, fold_of_rows
from defras_sim.arm.true_joints import true_joints
from defras_sim.effects.arm_joints import JOINTS, JointName, unit
from defras_sim.effects.effect import Extension, Values
from defras_sim.effects.joint_play import EFFECT as JOINT_PLAY
from defras_sim.effects.servo_lag import EFFECT as SERVO_LAG
from defras_sim.geometry import Floats

PHASES = ("still", "rising", "falling")

# Beyond any joint of a PSM (limits in defras_sim.arm.limits): then it is another unit.
_LARGEST_ANGLE_RAD = 6.5
_LARGEST_INSERTION_M = 0.5

_FLOOR = {"rad": 5e-4, "m": 5e-5}
"""Half a milliradian is 0.1 mm at the tip of a far inserted arm."""


@dataclass(frozen=True)
class JointRun:
    """One trajectory: ``setpoint`` (n, 6) and ``measured`` (n, 6), NaN where not measured."""

    name: str
    time_s: Floats
    setpoint: Floats
    measured: Floats
    noise_sd: Floats


class ArmProblem(TableProblem):
    """Trajectories of one arm; channels are the joints that were measured."""

    def __init__(self, runs: Sequence[JointRun], quality_: DataQuality) -> None:
        self.runs = tuple(runs)
        seen = np.any([np.isfinite(run.measured).any(axis=0) for run in self.runs], axis=0)
        self._joints = [i for i in range(len(JOINTS)) if seen[i]]
        super().__init__(
            _samples(self.runs, self._joints),
            joint_candidates(self._setpoints, [JOINTS[i] for i in self._joints]),
            self._compared([run.measured for run in self.runs]),
            quality_,
        )

    @staticmethod
    def of_tables(tables: Sequence[Table]) -> ArmProblem:
        """
        Raises:
            InvalidFile: a column is missing, set-points are in another unit than their header
                says, or no joint can be compared.
        """
        faults: list[DataFault] = []
        runs = [_run(table, faults) for table in tables]
        if not any(np.isfinite(run.measured).any() for run in runs):
            found = "; ".join(fault.sentence for fault in faults)
            raise tables[0].fault(
                "no joint was measured; expected columns as 'q5_measured_rad' with numbers in them"
                + (f" ({found})" if found else "")
            )
        return ArmProblem(runs, quality(tables, faults))

    def covariates(self) -> Sequence[Covariate]:
        """Each joint's own set-point, which it should follow."""
        return (Covariate("its set-point", "", self._compared(self._setpoints), followed=True),)

    @property
    def _setpoints(self) -> list[Floats]:
        return [run.setpoint for run in self.runs]

    def predicted(self, model: Extension) -> Floats:
        return self._compared([true_joints(model, run.time_s, run.setpoint) for run in self.runs])

    def starts(
        self, model: Extension, candidate: Candidate
    ) -> Sequence[tuple[Values, Sequence[Values]]]:
        if candidate.effect.name == JOINT_PLAY.name:
            return play_starts(self._setpoints, candidate)
        if candidate.effect.name == SERVO_LAG.name:
            return lag_starts(candidate)
        return ()

    def _compared(self, joints: Sequence[Floats]) -> Floats:
        """The numbers that are compared, of each run's (rows, 6): by run, joint, time."""
        return np.concatenate([each[:, self._joints].T.ravel() for each in joints])


def _run(table: Table, faults: list[DataFault]) -> JointRun:
    """Set-points of all rows whose time and set-point can be believed; measured, where it can."""
    kept, found = rows_in_time(table)
    faults += found
    told = [f"{q}_setpoint_{unit(q)}" for q in JOINTS]
    setpoint = np.stack([_setpoint(table, name) for name in told], axis=1)
    commanded, found = measured_rows(table, "set-points", told, kept)
    faults += found
    seen = [q for q in JOINTS if _measured(q) in table.columns]
    measured = np.full(setpoint.shape, np.nan)
    sd = np.full(len(JOINTS), np.nan)
    if seen:
        columns = [_measured(q) for q in seen]
        believed, found = measured_rows(table, "measured joints", columns, commanded)
        faults += found
        for joint in seen:
            column = JOINTS.index(joint)
            measured[believed, column] = _position(table, _measured(joint), faults)[believed]
            sd[column] = _scatter(table, joint, measured[:, column] - setpoint[:, column])
    time_s = table["time_s"]
    return JointRun(table.name, time_s[commanded], setpoint[commanded], measured[commanded], sd)


def _measured(joint: JointName) -> str:
    return f"{joint}_measured_{unit(joint)}"


def _setpoint(table: Table, column: str) -> Floats:
    """A column of commanded positions; without it nothing can be said of any joint."""
    suspected, found = _other_unit(table, column)
    if suspected:
        raise table.fault(f"{found[0].what}; name the unit in the header ('_deg', '_mm')")
    return table[column]


def _position(table: Table, column: str, faults: list[DataFault]) -> Floats:
    """A column of measured positions, NaN throughout where it seems to be in another unit."""
    suspected, found = _other_unit(table, column)
    faults += found
    return np.full(len(table), np.nan) if suspected else table[column]


def _other_unit(table: Table, column: str) -> tuple[bool, list[DataFault]]:
    if column.endswith("_rad"):
        return suspected_unit(table, column, _LARGEST_ANGLE_RAD, "these seem to be degrees")
    return suspected_unit(table, column, _LARGEST_INSERTION_M, "these seem to be millimetres")


def _scatter(table: Table, joint: JointName, error: Floats) -> float:
    """Scatter of a joint's readings: as the table says, else what changes from row to row."""
    known = table.columns.get(f"{joint}_measured_sd_{unit(joint)}")
    if known is not None and np.isfinite(known).any():
        return float(np.sqrt(np.nanmean(known**2)))
    return scatter(error[np.isfinite(error)])


def _samples(runs: Sequence[JointRun], joints: Sequence[int]) -> Samples:
    """Labels of what is compared, by run, joint, time."""
    channels = tuple(_channel(runs, i) for i in joints)
    folds = fold_of_rows([len(run.time_s) for run in runs])
    count = len(joints)
    return Samples(
        channels=channels,
        trajectories=tuple(run.name for run in runs),
        phases=PHASES,
        time_s=np.concatenate([np.tile(run.time_s, count) for run in runs]),
        channel=np.concatenate([np.repeat(np.arange(count), len(run.time_s)) for run in runs]),
        trajectory=np.concatenate(
            [np.full(count * len(run.time_s), t) for t, run in enumerate(runs)]
        ),
        phase=np.concatenate([_phases(run.setpoint[:, joints]) for run in runs]),
        fold=np.concatenate([np.tile(fold, count) for fold in folds]),
    )


def _channel(runs: Sequence[JointRun], index: int) -> Channel:
    joint = JOINTS[index]
    variance = np.nanmean([run.noise_sd[index] ** 2 for run in runs])
    return Channel(joint, joint, unit(joint), float(np.sqrt(variance)), _FLOOR[unit(joint)])


def _phases(setpoint: Floats) -> np.ndarray:
    """Which way each joint (rows, k) is told to go, joint after joint: an index into PHASES."""
    step = np.diff(setpoint, axis=0, prepend=setpoint[:1])
    return np.where(step > 0, 1, np.where(step < 0, 2, 0)).T.ravel()
