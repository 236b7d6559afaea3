"""Whether this computer can record and stream."""

from __future__ import annotations

import shutil

from defras_bt.dvrk.checking.bench import CheckBench
from defras_bt.dvrk.checking.finding import Finding, ok, wrong


class DiskCheck:
    """Room for the recording."""

    def run(self, bench: CheckBench) -> list[Finding]:
        free_mb = shutil.disk_usage(bench.out).free / 1e6
        least_mb = bench.setup.limits.disk_free_mb
        what = f"{free_mb:,.0f} MB are free at {bench.out}"
        if free_mb < least_mb:
            todo = f"Make room: {least_mb:,.0f} MB are needed (limits.disk_free_mb)."
            return [wrong("disk", "computer", what, todo)]
        return [ok("disk", "computer", what)]
