"""A pulled specimen as a problem: the stretch it was led through beside the force it needed.

Tables with ``time_s``, ``stretch`` (1 at rest), ``force_N`` and ``area_m2`` (unstretched, the same
in all rows); ``force_sd_N`` where the scatter of the readings is known. A table is one specimen
that was not stretched before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from defras_bt.diagnosis.problem import Candidate, Channel, Covariate, Samples
from defras_bt.diagnosis.quality import DataFault, DataQuality, Mask, Sieve
from defras_bt.diagnosis.tables import Table
from defras_bt.diagnosis.tables_quality import measured_rows, quality, rows_in_time, scatter
from defras_bt.diagnosis.twins.coupon_remarks import last_hold, linearity_remark
from defras_bt.diagnosis.twins.table_problem import TableProblem, fold_of_rows
from defras_sim.coupon.specimen import nominal_stress_pa
from defras_sim.effects.effect import Effect, Extension, Values
from defras_sim.effects.softening import EFFECT as SOFTENING
from defras_sim.effects.stiffness import EFFECT as STIFFNESS
from defras_sim.effects.strain_stiffening import EFFECT as STRAIN_STIFFENING
from defras_sim.effects.stress_relaxation import EFFECT as STRESS_RELAXATION
from defras_sim.geometry import Floats

PHASES = ("loading", "holding", "unloading")

_LARGEST_STRETCH = 30.0
_STILL = 1e-3
"""Of the largest rate of a run: with less it is held."""
_WIDTHS = (0.1, 0.25, 0.5, 1.0)
_TIMES = 12
_ROUNDS = 4
"""In which a pull is held out: its end alone would be asked beyond the range."""
_SPLIT = 0.6
_ENOUGH = 20
"""Rows; with fewer nothing is scored."""
_FLOOR_SHARE = 0.01
"""Of the largest force: what load cells and specimens are not reproducible to."""


@dataclass(frozen=True)
class PullRun:
    """One specimen. ``force_n`` (n,), NaN where it was not measured or is not compared."""

    name: str
    time_s: Floats
    stretch: Floats
    force_n: Floats
    area_m2: float
    noise_sd_n: float


class CouponProblem(TableProblem):
    """Specimens of one material; the channel is the force.

    ``young_modulus_pa``: that of a neo-Hookean material that fits best. The candidate
    ``stiffness``, always fitted, is a factor on it.
    """

    def __init__(self, runs: Sequence[PullRun], quality_: DataQuality) -> None:
        self.runs = tuple(runs)
        self.young_modulus_pa = _best_modulus_pa(self.runs)
        super().__init__(
            _samples(self.runs),
            _causes(self.runs),
            np.concatenate([run.force_n for run in self.runs]),
            quality_,
        )

    @staticmethod
    def of_tables(tables: Sequence[Table]) -> CouponProblem:
        """
        Raises:
            InvalidFile: a column is missing, the stretch is not one, or nothing can be compared.
        """
        faults: list[DataFault] = []
        runs = [_run(table, faults) for table in tables]
        if not any(np.isfinite(run.force_n).sum() > 4 for run in runs):
            raise tables[0].fault(
                "no row can be compared: " + "; ".join(f.sentence for f in faults)
            )
        return CouponProblem(runs, quality(tables, faults))

    def within(self, smallest: float, largest: float) -> CouponProblem:
        """The same specimens, compared only while the stretch lies between two values.

        What happened outside still counts for what the material remembers.
        """
        runs = [
            replace(
                run,
                force_n=np.where(
                    (run.stretch >= smallest) & (run.stretch <= largest), run.force_n, np.nan
                ),
            )
            for run in self.runs
        ]
        part = CouponProblem(runs, self.quality)
        part.young_modulus_pa = self.young_modulus_pa
        return part

    def split_by_range(self) -> tuple[CouponProblem, CouponProblem, str] | None:
        """Up to 60 % of the way to the largest stretch, and beyond."""
        largest = max(float(np.max(run.stretch)) for run in self.runs)
        limit = 1 + _SPLIT * (largest - 1)
        below, above = self.within(0.0, limit), self.within(limit, np.inf)
        enough = all(np.isfinite(p.measured).sum() >= _ENOUGH for p in (below, above))
        return (below, above, f"a stretch of {limit:.2f}") if enough else None

    def covariates(self) -> Sequence[Covariate]:
        """How far each specimen is stretched."""
        return (Covariate("the stretch", "1", np.concatenate([r.stretch for r in self.runs])),)

    def remarks(self, model: Extension) -> Sequence[str]:
        holds = []
        for run in self.runs:
            force_n = self._force_n(model, run)
            held = _phases(run) == PHASES.index("holding")
            holds.append(last_hold(run.time_s, run.stretch, run.force_n, force_n, held))
        found = linearity_remark([hold for hold in holds if hold is not None])
        return [found] if found else []

    def predicted(self, model: Extension) -> Floats:
        return np.concatenate([self._force_n(model, run) for run in self.runs])

    def _force_n(self, model: Extension, run: PullRun) -> Floats:
        stress_pa = nominal_stress_pa(model, self.young_modulus_pa, run.time_s, run.stretch)
        return run.area_m2 * stress_pa

    def starts(
        self, model: Extension, candidate: Candidate
    ) -> Sequence[tuple[Values, Sequence[Values]]]:
        if candidate.effect.name == STRESS_RELAXATION.name:
            return [
                ({"fraction": 0.0, "time_s": float(time_s)}, [{"fraction": 0.5}])
                for time_s in _times_s(self.runs)
            ]
        if candidate.effect.name == SOFTENING.name:
            return [({"share": 0.0, "width": width}, [{"share": 0.5}]) for width in _WIDTHS]
        return ()


def _times_s(runs: Sequence[PullRun]) -> Floats:
    """Times of relaxation to try: from a few rows to what the longest run can tell from forever."""
    shortest = min(float(np.median(np.diff(run.time_s))) for run in runs)
    longest = max(float(run.time_s[-1] - run.time_s[0]) for run in runs)
    bounds = next(p for p in STRESS_RELAXATION.parameters if p.name == "time_s")
    low, high = np.clip([2 * shortest, longest], bounds.lower, bounds.upper)
    return np.geomspace(low, high, _TIMES)


def _causes(runs: Sequence[PullRun]) -> tuple[Candidate, ...]:
    """Material laws; softening shows only where some specimen was let go again."""
    effects: list[Effect] = [STRAIN_STIFFENING, STRESS_RELAXATION]
    if any((_phases(run) == PHASES.index("unloading")).any() for run in runs):
        effects.append(SOFTENING)
    return (
        Candidate(STIFFNESS, STIFFNESS.parameters, base=True),
        *(Candidate(effect, effect.parameters) for effect in effects),
    )


def _run(table: Table, faults: list[DataFault]) -> PullRun:
    time_s, stretch, force_n = table["time_s"], table["stretch"], table["force_N"]
    kept, found = rows_in_time(table)
    faults += found
    sieve = Sieve(f"{table.name} stretch", time_s)
    sieve.kept = kept
    sieve.leave_out(~np.isfinite(stretch), "not_finite", "stretch is no number")
    _check_stretch(table, stretch[sieve.kept])
    faults += sieve.faults
    believed, found = measured_rows(table, "force", ["force_N"], sieve.kept)
    faults += found
    compared: Mask = believed[sieve.kept]
    force_n = np.where(compared, force_n[sieve.kept], np.nan)
    known = table.columns.get("force_sd_N")
    sd_n = scatter(force_n[compared]) if known is None else float(np.sqrt(np.nanmean(known**2)))
    return PullRun(
        table.name, time_s[sieve.kept], stretch[sieve.kept], force_n, _area_m2(table), sd_n
    )


def _check_stretch(table: Table, stretch: Floats) -> None:
    if not len(stretch):
        raise table.fault("has no row with a time and a stretch")
    if np.min(stretch) <= 0 or np.median(stretch) > _LARGEST_STRETCH:
        raise table.fault(
            f"stretch is {np.min(stretch):.4g} to {np.max(stretch):.4g}; it should be length by "
            "unstretched length, 1 at rest: strain or percent need to be converted"
        )


def _area_m2(table: Table) -> float:
    area_m2 = table["area_m2"]
    known = area_m2[np.isfinite(area_m2)]
    if not len(known) or np.ptp(known) > 1e-9 * abs(known[0]) or known[0] <= 0:
        raise table.fault("area_m2 should be one positive number, the unstretched cross-section")
    return float(known[0])


def _best_modulus_pa(runs: Sequence[PullRun]) -> float:
    """Least squares of the plain law."""
    told = np.concatenate(
        [run.area_m2 * nominal_stress_pa({}, 1.0, run.time_s, run.stretch) for run in runs]
    )
    seen = np.concatenate([run.force_n for run in runs])
    rows = np.isfinite(seen)
    return float(told[rows] @ seen[rows] / (told[rows] @ told[rows]))


def _samples(runs: Sequence[PullRun]) -> Samples:
    largest = max(float(np.nanmax(np.abs(run.force_n), initial=0.0)) for run in runs)
    sd_n = float(np.sqrt(np.mean([run.noise_sd_n**2 for run in runs])))
    counts = [len(run.time_s) for run in runs]
    return Samples(
        channels=(Channel("force", "force", "N", sd_n, _FLOOR_SHARE * largest),),
        trajectories=tuple(run.name for run in runs),
        phases=PHASES,
        time_s=np.concatenate([run.time_s for run in runs]),
        channel=np.zeros(sum(counts), np.int64),
        trajectory=np.repeat(np.arange(len(runs)), counts),
        phase=np.concatenate([_phases(run) for run in runs]),
        fold=np.concatenate(fold_of_rows(counts, rounds=_ROUNDS)),
    )


def _phases(run: PullRun) -> np.ndarray:
    """Whether the specimen is stretched, held or let go (n,): an index into PHASES."""
    rate = np.gradient(run.stretch, run.time_s)
    still = np.abs(rate) < _STILL * np.max(np.abs(rate))
    return np.where(still, 1, np.where(rate > 0, 0, 2))
