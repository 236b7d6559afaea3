"""Write everything a run leaves, for the synthetic run: ``python tests/recording/look.py OUT``."""

from __future__ import annotations

import sys
import time
from pathlib import Path

from defras_bt.recording.bag import BagRecorder
from defras_bt.recording.composite import CompositeRecorder
from defras_bt.recording.report import ReportRecorder
from defras_bt.recording.summary import SummaryRecorder
from defras_bt.recording.timeline import TimelineRecorder
from tests.recording.synthetic_run import SyntheticRun


def main(out: Path) -> None:
    out.mkdir(parents=True, exist_ok=True)
    run = SyntheticRun()
    numbers = SummaryRecorder(out / "run.json")
    recorder = CompositeRecorder(
        [
            numbers,
            TimelineRecorder(out / "run.rrd"),
            BagRecorder(out / "recording.mcap"),
            ReportRecorder(out / "report.html"),
        ]
    )
    recorder.start(run.info)
    spent_s = 0.0
    for record in run.ticks():
        begin = time.perf_counter()
        recorder.tick(record)
        spent_s += time.perf_counter() - begin
    print(f"{1000 * spent_s / (record.tick + 1):.2f} ms a tick")
    recorder.finish(numbers.summary("goal", wall_s=spent_s))
    for file in sorted(out.iterdir()):
        print(f"{file.stat().st_size / 1e6:8.2f} MB  {file.name}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
