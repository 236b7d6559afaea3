"""A world of two perfect tools. Nothing here computes tissue."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Attachments, Camera, Roi, Scene
from defras_sim.surface import Surface
from defras_sim.worlds.kinematic_tool import KinematicTool
from defras_sim.worlds.protocol import (
    HOLD,
    ArmCommand,
    ArmObservation,
    Command,
    Observation,
    PointCloud,
)


def bench_scene() -> Scene:
    """Held along the largest x; the region lies on the free side. The camera has no noise."""
    return Scene(
        name="bench",
        attachments=Attachments(map=("..........##",) * 12),
        roi=Roi(center_x_m=0.01, center_y_m=0.0),
        depth_camera=Camera(position_m=(0.17, 0.0, 0.20), target_m=(0.0, 0.0, 0.0)),
    )


def flat_cloud_m() -> Floats:
    """More points than sensing asks for."""
    x, y = np.meshgrid(np.linspace(-0.05, 0.05, 6), np.linspace(-0.05, 0.05, 6))
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])


class BenchWorld:
    """Two tools that move exactly as told. A jaw takes tissue below 4 mm unless ``slippery``.

    ``cloud_m`` and ``visibility`` None: the camera is silent from then on. ``broken`` maps
    "observe", "command" or "step" to the exception that it raises.
    """

    name = "bench"

    def __init__(self, scene: Scene) -> None:
        self.tick_s = scene.tick_s
        self.tools: dict[str, KinematicTool] = {
            arm: KinematicTool.at(np.array(part.home_tip_m)) for arm, part in scene.arms.items()
        }
        self.cloud_m: Floats | None = flat_cloud_m()
        self.visibility: float | None = 0.0
        self.slippery = False
        self.stuck: set[str] = set()
        self.broken: dict[str, Exception] = {}
        self.sent: list[Command] = []
        self.ticks = 0

    @property
    def time_s(self) -> float:
        return self.ticks * self.tick_s

    def observe(self) -> Observation:
        self._break("observe")
        now_s, cloud_m = self.time_s, self.cloud_m
        return Observation(
            time_s=now_s,
            arms={
                arm: ArmObservation(
                    now_s, tool.tissue_from_tip, tool.tissue_from_tip, tool.jaw_rad, tool.grasped
                )
                for arm, tool in self.tools.items()
            },
            cloud=None if cloud_m is None else PointCloud(now_s, cloud_m),
            roi_visibility=self.visibility,
            roi_visibility_stamp_s=None if self.visibility is None else now_s,
        )

    def command(self, command: Command) -> None:
        self._break("command")
        self.sent.append(command)

    def step(self) -> None:
        self._break("step")
        command = self.sent[-1] if self.sent else HOLD
        for arm, tool in self.tools.items():
            motion = command.arms.get(arm, ArmCommand())
            if arm in self.stuck:
                motion = replace(motion, jaw_rad=None)
            tool.step(motion, self.tick_s, self._on_tissue)
        self.ticks += 1

    def true_force_n(self) -> float | None:
        return None

    def true_surface(self) -> Surface | None:
        return None

    def close(self) -> None:
        pass

    def _on_tissue(self, tip: Pose) -> bool:
        return not self.slippery and bool(tip.position_m[2] < 0.004)

    def _break(self, where: str) -> None:
        if where in self.broken:
            raise self.broken[where]
