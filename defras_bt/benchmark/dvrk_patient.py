"""The patient of the dVRK's campaign: runs take seconds, and a laboratory's first ones are slow."""

from __future__ import annotations

from pathlib import Path

from ruamel.yaml import YAML

from defras_bt.benchmark.fault_cases import patient
from defras_sim.scene import GraspGrid, Motion, Scene


def slow_patient() -> Scene:
    """The fault campaign's patient with two grasp points, reached at 30 mm/s."""
    few = {
        "grasp": GraspGrid(columns=2, rows=1, margin_m=0.01),
        "motion": Motion(reach_speed_m_s=0.03),
    }
    return patient().model_copy(update=few)


def write_scene(scene: Scene, file: Path) -> None:
    """
    Raises:
        OSError: the file cannot be written.
    """
    content = scene.model_dump(mode="json", exclude_none=True, exclude_defaults=True)
    with file.open("w", encoding="utf-8") as stream:
        YAML().dump(content, stream)
