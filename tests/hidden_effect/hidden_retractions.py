"""Recordings of another model that hides something, and the command as a user calls it.

Reality is made of quadratic tetrahedra on another mesh, led along at another time step, and seen
with noise that remembers, drifts and drops out; the command gets the recording and nothing else.
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from defras_bt.benchmark.hidden_noise import NoiseSpectrum
from defras_bt.benchmark.hidden_recording import reality, record
from defras_bt.benchmark.hidden_retraction import Script
from defras_bt.cli.files import find_scene
from defras_bt.cli.main import main
from defras_sim.effects.effect import Extension
from defras_sim.scene import Scene, load_scene
from defras_sim.scene_file import write_scene

SCRIPT = Script(
    "psm1",
    (2, 4),
    lift_m=0.02,
    move_m=(0.008, -0.006),
    fold_m=0.008,
    speed_m_s=0.025,
    hold_s=0.4,
    rest_s=1.2,
)
FARTHER = Script(
    "psm1",
    (2, 4),
    lift_m=0.026,
    move_m=(0.01, -0.004),
    fold_m=0.01,
    speed_m_s=0.03,
    hold_s=0.2,
    rest_s=1.0,
)

# Effects with a place or a time of their own begin in dozens of ways each, which takes minutes: the
# boards of `defras benchmark diagnosis` look for all.
COSTLY = (
    "anisotropy",
    "attachment_tear",
    "breathing",
    "extra_attachment",
    "inclusion",
    "joint_play",
    "missing_attachment",
)


@dataclass(frozen=True)
class Laboratory:
    """What a user has: a scene, recordings, and the command. Everything is kept in ``folder``."""

    folder: Path
    monkeypatch: pytest.MonkeyPatch

    def believed(self) -> Scene:
        """A shipped scene on a mesh that is solved in milliseconds."""
        scene = find_scene("sim1")[1]
        return scene.model_copy(
            update={
                "tissue": scene.tissue.model_copy(update={"elements_xyz": (4, 4, 1)}),
                "depth_camera": scene.depth_camera.model_copy(update={"period_s": 0.16}),
            }
        )

    def recording(self, hidden: Extension, seed: int, script: Script = SCRIPT) -> Path:
        """A retraction where ``hidden`` is true and nobody knows."""
        file = self.folder / f"measured_{seed}.mcap"
        actual = reality(self.believed(), hidden, elements_xyz=(6, 6, 1))
        record(actual, script, NoiseSpectrum(), np.random.default_rng(seed), file)
        return file

    def verdict(self, data: Path, *more: str) -> dict[str, Any]:
        """verdict.json of ``defras diagnose``, whose other files are looked at as well."""
        scene, out = self.folder / "scene.yaml", self.folder / "out"
        write_scene(self.believed(), scene)
        arguments = ["diagnose", str(data), "--scene", str(scene), "-o", str(out), "--jobs", "1"]
        arguments += [part for effect in COSTLY for part in ("--without", effect)]
        self.monkeypatch.setattr(sys, "argv", ["defras", *arguments, *more])
        with pytest.raises(SystemExit) as ended:
            main()
        assert ended.value.code == 0
        assert (out / "report.html").stat().st_size > 10_000
        assert (out / "diagnosis.rrd").stat().st_size > 10_000
        found: dict[str, Any] = json.loads((out / "verdict.json").read_text(encoding="utf-8"))
        return found

    def extended(self) -> Scene:
        """The scene that the last diagnosis left."""
        return load_scene(self.folder / "out" / "extended_scene.yaml")
