"""ModelWorld: the tissue model with the actual attachments, perfect tools and ray-cast cameras."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from defras_sim.camera.depth import depth_cloud_m
from defras_sim.camera.ray_caster import RayCaster
from defras_sim.camera.visibility import roi_visibility
from defras_sim.geometry import Pose
from defras_sim.scene import Scene
from defras_sim.surface import Surface
from defras_sim.tissue.model import TissueModel
from defras_sim.worlds.clock import TickClock
from defras_sim.worlds.error import WorldError
from defras_sim.worlds.jaw_contact import meets_tissue
from defras_sim.worlds.kinematic_tool import KinematicTool
from defras_sim.worlds.protocol import (
    HOLD,
    ArmCommand,
    ArmObservation,
    Command,
    Observation,
    PointCloud,
)

# Joint encoders resolve the tip to a few hundredths of a millimetre.
TIP_NOISE_SD_M = 2e-5


class ModelWorld:
    """A quasi-static reality for a scene, on the mesh of ``scene.simulated``.

    Equal scenes, commands and generators give equal runs.
    """

    name = "model"

    def __init__(self, scene: Scene, rng: np.random.Generator) -> None:
        """``scene`` is the actual one. ``rng`` makes the sensors' noise."""
        self.tick_s = scene.tick_s
        self._scene = scene
        self._rng = rng
        self._clock = TickClock(scene.tick_s)
        self._command = HOLD
        self._closed = False
        self._tools = {
            arm: KinematicTool.at(np.array(part.home_tip_m)) for arm, part in scene.arms.items()
        }
        self._model = TissueModel(scene.simulated)
        self._state = self._model.solve({})
        if not self._state.converged:
            raise WorldError("the tissue finds no equilibrium at rest")
        self._latest = Observation(0.0, {})
        self._sense()

    @property
    def time_s(self) -> float:
        return self._clock.time_s

    def observe(self) -> Observation:
        return self._latest

    def command(self, command: Command) -> None:
        """Set the motion of the coming tick.

        Raises:
            ValueError: an arm is unknown or a number is not finite.
        """
        command.require_valid(self._tools)
        if not self._closed:
            self._command = command

    def step(self) -> None:
        """Let ``tick_s`` of world time pass.

        Raises:
            WorldError: the tissue has no equilibrium that can be followed.
        """
        self._clock.tick()
        changed = False
        for arm, tool in self._tools.items():
            held = tool.grasped
            motion = self._command.arms.get(arm, ArmCommand())
            acted = tool.step(motion, self.tick_s, self._on_tissue)
            if tool.grasped != held:
                if tool.grasped:
                    self._model.grasp(arm, tool.tissue_from_tip)
                else:
                    self._model.release(arm)
            changed |= acted and (held or tool.grasped)
        self._command = HOLD
        if changed:
            self._settle()
        self._sense()

    def true_force_n(self) -> float:
        forces = self._state.grasp_forces_n.values()
        return max((float(np.linalg.norm(force)) for force in forces), default=0.0)

    def true_surface(self) -> Surface:
        return self._state.surface

    def close(self) -> None:
        self._closed = True
        self._command = HOLD

    def _on_tissue(self, tissue_from_tip: Pose) -> bool:
        return meets_tissue(self._state.surface, tissue_from_tip.position_m)

    def _settle(self) -> None:
        tips: dict[str, Pose] = {
            arm: tool.tissue_from_tip for arm, tool in self._tools.items() if tool.grasped
        }
        state = self._model.solve(tips)
        if not state.converged:
            where = ", ".join(f"{arm} at {np.round(p.position_m, 4)} m" for arm, p in tips.items())
            raise WorldError(
                f"at {self.time_s:.2f} s the actual tissue has no equilibrium near the last one "
                f"({where or 'nothing held'}); the motion is too far or too fast for the model"
            )
        self._state = state

    def _sense(self) -> None:
        """Read every sensor that is due; the others keep their last reading."""
        scene, latest = self._scene, self._latest
        update = replace(latest, time_s=self.time_s, arms=self._read_arms())
        cloud_due = self._clock.due(scene.depth_camera.period_s)
        picture_due = self._clock.due(scene.endoscope.period_s)
        if cloud_due or picture_due:
            surface = self._state.surface
            tissue = RayCaster(surface)
            if cloud_due:
                points = depth_cloud_m(scene.depth_camera, surface, tissue, self._rng)
                update = replace(update, cloud=PointCloud(self.time_s, points))
            if picture_due:
                seen = roi_visibility(scene, tissue)
                update = replace(update, roi_visibility=seen, roi_visibility_stamp_s=self.time_s)
        self._latest = update

    def _read_arms(self) -> dict[str, ArmObservation]:
        return {arm: self._read_arm(tool) for arm, tool in self._tools.items()}

    def _read_arm(self, tool: KinematicTool) -> ArmObservation:
        noise = TIP_NOISE_SD_M * self._rng.standard_normal(3)
        return ArmObservation(
            stamp_s=self.time_s,
            tissue_from_tip=tool.tissue_from_tip.moved(noise),
            setpoint_tissue_from_tip=tool.tissue_from_tip,
            jaw_rad=tool.jaw_rad,
            grasped=tool.grasped,
        )
