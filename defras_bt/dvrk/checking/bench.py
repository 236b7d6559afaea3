"""What checks look at: a set-up, its registration, its arms and cameras as they are now."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from defras_bt.dvrk.camera_source import CameraReadings, CameraSource
from defras_bt.dvrk.checking.finding import Finding
from defras_bt.dvrk.checking.watch import Watch
from defras_bt.dvrk.crtk.arm import CrtkArm
from defras_bt.dvrk.registering.registration import Registration
from defras_bt.dvrk.settings import Setup
from defras_bt.dvrk.transport.transport import Transport
from defras_sim.scene import Scene


@dataclass(frozen=True)
class CheckBench:
    """``watches`` have listened for some seconds when checks are run, and ``looks`` are what the
    cameras showed meanwhile, each with their clock's time. ``out``: where recordings will go."""

    setup: Setup
    scene: Scene
    registration: Registration
    transport: Transport
    arms: Mapping[str, CrtkArm]
    watches: Mapping[str, Watch]
    cameras: CameraSource
    looks: Sequence[tuple[CameraReadings, float]]
    out: Path


class Check(Protocol):
    """Looks at one matter; never moves anything."""

    def run(self, bench: CheckBench) -> list[Finding]:
        """One finding for each arm or thing it concerns."""
