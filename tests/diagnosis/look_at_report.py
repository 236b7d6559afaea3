"""Write what a synthetic diagnosis leaves: ``python tests/diagnosis/look_at_report.py OUT``."""

from __future__ import annotations

import sys
from pathlib import Path

from rich.console import Console

from defras_bt.diagnosis.exhibits import Exhibits
from defras_bt.diagnosis.report_files import write_diagnosis
from defras_bt.diagnosis.report_terminal import print_diagnosis
from defras_sim.effects.library import effects
from tests.diagnosis.synthetic_diagnosis import (
    ORIGIN,
    SCENE_FILE,
    synthetic_curves,
    synthetic_diagnosis,
    synthetic_replay,
)


def main(out: Path) -> None:
    exhibits = Exhibits(synthetic_curves().comparisons, synthetic_replay().replay)
    diagnosis = synthetic_diagnosis()
    print_diagnosis(Console(), diagnosis, effects())
    files = write_diagnosis(
        out, diagnosis, ORIGIN, effects(), scene_file=SCENE_FILE, exhibits=exhibits
    )
    for file in files:
        print(f"{file.stat().st_size / 1e6:8.2f} MB  {file}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
