"""The problem that tables of measured data pose: which twin, and what it compares."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from defras_bt.diagnosis.tables import read_tables
from defras_bt.diagnosis.twins.arm import ArmProblem
from defras_bt.diagnosis.twins.arm_load import ArmLoadProblem
from defras_bt.diagnosis.twins.coupon import CouponProblem
from defras_bt.diagnosis.twins.table_problem import TableProblem


def read_problem(paths: Sequence[Path], twin: Literal["arm", "coupon"]) -> TableProblem:
    """Tables of one or several files as one problem; all its trajectories share the model.

    An arm's tables hold joints over time or its tip under load, by their columns.

    Raises:
        InvalidFile: a file cannot be used as it is, or files of both kinds are mixed.
    """
    tables = [table for path in paths for table in read_tables(path)]
    if twin == "coupon":
        return CouponProblem.of_tables(tables)
    under_load = [any(c.startswith("force_") for c in table.columns) for table in tables]
    if all(under_load):
        return ArmLoadProblem.of_tables(tables)
    if any(under_load):
        odd = tables[under_load.index(True)]
        raise odd.fault(
            "holds an arm under load, other tables its joints over time; diagnose them apart"
        )
    return ArmProblem.of_tables(tables)
