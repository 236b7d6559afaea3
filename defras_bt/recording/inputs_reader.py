"""A recording back as what an executive was told."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from defras_bt.recording.bag_reader import read_bag
from defras_bt.recording.inputs import CLOUD_TOPIC, INPUTS_TOPIC, SETUP_TOPIC, TickInput, read_input

BAG = "recording.mcap"


class NoInputs(ValueError):
    """There is no recording of an executive's inputs; the message says what would be valid."""


@dataclass(frozen=True)
class RecordedInputs:
    """``setup`` is what the run started from, as plain values; ``ticks`` are in order."""

    file: Path
    setup: Mapping[str, Any]
    ticks: tuple[TickInput, ...]


def read_inputs(run: Path) -> RecordedInputs:
    """Read a run's folder, or its recording. One that a killed process left is read to its end.

    Raises:
        NoInputs: it is not there, or does not say what the executive was told.
    """
    file = run / BAG if run.is_dir() else run
    if not file.is_file():
        raise NoInputs(f"{file} does not exist; give a folder that defras run --out left")
    series = read_bag(file, (SETUP_TOPIC, INPUTS_TOPIC, CLOUD_TOPIC)).series
    missing = [topic for topic in (SETUP_TOPIC, INPUTS_TOPIC) if topic not in series]
    if missing:
        raise NoInputs(
            f"{file} has no {' and no '.join(missing)}: it is of another program or an older "
            "version, or ended before its first second"
        )
    clouds = series[CLOUD_TOPIC].points_m if CLOUD_TOPIC in series else ()
    return RecordedInputs(
        file,
        json.loads(series[SETUP_TOPIC].texts[0]),
        tuple(read_input(text, clouds) for text in series[INPUTS_TOPIC].texts),
    )
