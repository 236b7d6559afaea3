"""The arm under load as a problem: how far its tip gives way to forces on it.

Tables with, for each axis that was pushed along, ``force_x_N`` (on the tip),
``tip_setpoint_x_m`` (by the arm's own kinematics) and ``tip_measured_x_m`` (by a tracker outside),
and ``reach_m`` from the remote centre to the tip; ``time_s``, ``tip_measured_x_sd_m`` if known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from defras_bt.diagnosis.problem import Candidate, Channel, Integers, Samples
from defras_bt.diagnosis.quality import DataFault, DataQuality, Mask, Sieve
from defras_bt.diagnosis.tables import Table
from defras_bt.diagnosis.tables_quality import measured_rows, quality, rows_in_time, scatter
from defras_bt.diagnosis.twins.table_problem import TableProblem, fold_of_rows
from defras_sim.effects.arm_compliance import AXES, compliance_name, growth_name
from defras_sim.effects.arm_compliance import EFFECT as ARM_COMPLIANCE
from defras_sim.effects.effect import Extension
from defras_sim.geometry import Floats

PHASES = ("loading", "unloading")

_FLOOR_M = 2e-5
_SAME_REACH_M = 1e-3
_CONTACT_SHARE = 0.05
"""Of the largest force in a run: with less the tip touches nothing yet."""


@dataclass(frozen=True)
class LoadRun:
    """One axis in one run, rows (n,) in order. ``error_m``: measured less kinematic tip."""

    name: str
    axis: str
    time_s: Floats
    reach_m: Floats
    force_n: Floats
    error_m: Floats
    noise_sd_m: float


class ArmLoadProblem(TableProblem):
    """Pushes of one arm against something; channels are the axes.

    Where the tracker stands is known to no fraction of a millimetre, so every run is compared
    less its mean: only how the error *changes* with the force counts.
    """

    def __init__(self, runs: Sequence[LoadRun], quality_: DataQuality) -> None:
        self.runs = tuple(runs)
        axes = [axis for axis in AXES if any(run.axis == axis for run in self.runs)]
        super().__init__(
            _samples(self.runs, axes),
            tuple(cause for axis in axes for cause in _causes(self.runs, axis)),
            np.concatenate([_centred(run.error_m) for run in self.runs]),
            quality_,
        )

    @staticmethod
    def of_tables(tables: Sequence[Table]) -> ArmLoadProblem:
        """
        Raises:
            InvalidFile: a column is missing, or no axis has all of its columns.
        """
        faults: list[DataFault] = []
        runs = [run for table in tables for run in _runs(table, faults)]
        if not runs:
            raise tables[0].fault(
                "no axis has force, set-point and measured tip; expected columns as 'force_x_N', "
                "'tip_setpoint_x_m', 'tip_measured_x_m' and 'reach_m'"
            )
        return ArmLoadProblem(runs, quality(tables, faults))

    def split_by_range(self) -> tuple[ArmLoadProblem, ArmLoadProblem, str] | None:
        """The shorter reaches, and the longer ones; there should be two of each."""
        levels = _levels(self.runs)
        order = sorted(set(levels))
        if len(order) < 4:
            return None
        last = order[(len(order) - 1) // 2]
        near = [run for run, level in zip(self.runs, levels, strict=True) if level <= last]
        far = [run for run, level in zip(self.runs, levels, strict=True) if level > last]
        words = f"a reach of {last * _SAME_REACH_M:.3f} m"
        return ArmLoadProblem(near, self.quality), ArmLoadProblem(far, self.quality), words

    def predicted(self, model: Extension) -> Floats:
        unknown = [name for name in model if name != ARM_COMPLIANCE.name]
        if unknown:
            raise ValueError(f"{', '.join(unknown)} cannot be seen in pushes of an arm at rest")
        values = model.get(ARM_COMPLIANCE.name, {})
        found = []
        for run in self.runs:
            force_n = np.zeros((len(run.force_n), len(AXES)))
            force_n[:, AXES.index(run.axis)] = run.force_n
            shift_m = ARM_COMPLIANCE.deflection_m(values, run.reach_m, force_n)
            found.append(_centred(shift_m[:, AXES.index(run.axis)]))
        return np.concatenate(found)


def _runs(table: Table, faults: list[DataFault]) -> list[LoadRun]:
    """The axes of a table that it has all columns of."""
    kept, found = rows_in_time(table)
    faults += found
    time_s = table.columns.get("time_s", np.arange(len(table), dtype=float))
    runs = []
    for axis in AXES:
        force, told, seen = f"force_{axis}_N", f"tip_setpoint_{axis}_m", f"tip_measured_{axis}_m"
        if not {force, told, seen} <= set(table.columns):
            continue
        believed, found = measured_rows(table, f"push along {axis}", [force, told, seen], kept)
        faults += found
        touching = _touching(table, axis, time_s, table[force], believed, faults)
        error_m = table[seen] - table[told]
        known = table.columns.get(f"tip_measured_{axis}_sd_m")
        sd_m = scatter(error_m[touching]) if known is None else float(np.sqrt(np.nanmean(known**2)))
        name = f"{table.name} {axis}"
        rows = touching
        runs.append(
            LoadRun(
                name, axis, time_s[rows], table["reach_m"][rows], table[force][rows],
                error_m[rows], sd_m,
            )
        )  # fmt: skip
    return runs


def _touching(
    table: Table, axis: str, time_s: Floats, force_n: Floats, among: Mask, faults: list[DataFault]
) -> Mask:
    """Rows from the first in which the tip is pressed on; those before are left out."""
    sieve = Sieve(f"{table.name} push along {axis}", time_s)
    sieve.kept = among.copy()
    if among.any():
        size = np.abs(force_n)
        pressed = among & (size >= _CONTACT_SHARE * np.max(size[among]))
        before = np.arange(len(table)) < int(np.argmax(pressed))
        sieve.leave_out(before, "missing", "the tip touches nothing yet")
    faults += sieve.faults
    return sieve.kept


def _causes(runs: Sequence[LoadRun], axis: str) -> list[Candidate]:
    """Compliance along an axis; whether it grows with reach shows at more than one reach only."""
    constant, growth = (
        next(p for p in ARM_COMPLIANCE.parameters if p.name == name)
        for name in (compliance_name(axis), growth_name(axis))
    )
    found = [Candidate(ARM_COMPLIANCE, (constant,), axis)]
    if len(set(_levels([run for run in runs if run.axis == axis]))) > 1:
        found.append(Candidate(ARM_COMPLIANCE, (growth,), f"{axis},reach"))
    return found


def _levels(runs: Sequence[LoadRun]) -> list[int]:
    """Which reach each run was made at, in steps of a millimetre."""
    return [round(float(np.mean(run.reach_m)) / _SAME_REACH_M) for run in runs]


def _centred(values: Floats) -> Floats:
    return values - np.mean(values)


def _folds(runs: Sequence[LoadRun]) -> list[Integers]:
    """Runs at one reach are held out together: repeats of a push are no evidence of how another
    reach would do. With fewer than three reaches, as any table."""
    levels = _levels(runs)
    order = sorted(set(levels))
    if len(order) < 3:
        return fold_of_rows([len(run.time_s) for run in runs])
    return [
        np.full(len(run.time_s), order.index(level), np.int64)
        for run, level in zip(runs, levels, strict=True)
    ]


def _samples(runs: Sequence[LoadRun], axes: Sequence[str]) -> Samples:
    """Labels of what is compared, by run and time."""
    sd_m = [np.sqrt(np.mean([r.noise_sd_m**2 for r in runs if r.axis == axis])) for axis in axes]
    channels = tuple(
        Channel(axis, "tip", "m", float(sd), _FLOOR_M) for axis, sd in zip(axes, sd_m, strict=True)
    )
    counts = [len(run.time_s) for run in runs]
    rising = [np.gradient(np.abs(run.force_n)) >= 0 for run in runs]
    return Samples(
        channels=channels,
        trajectories=tuple(run.name for run in runs),
        phases=PHASES,
        time_s=np.concatenate([run.time_s for run in runs]),
        channel=np.repeat([axes.index(run.axis) for run in runs], counts),
        trajectory=np.repeat(np.arange(len(runs)), counts),
        phase=np.concatenate([np.where(up, 0, 1) for up in rising]),
        fold=np.concatenate(_folds(runs)),
    )
