"""ModelWorld: the tissue model with the actual attachments, kinematic tools, ray-cast cameras."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from defras_sim.camera.depth import depth_cloud_m
from defras_sim.camera.ray_caster import RayCaster
from defras_sim.camera.visibility import roi_visibility
from defras_sim.effects.camera_layer import CameraLayer
from defras_sim.effects.extended_tissue import ExtendedTissue
from defras_sim.effects.layers import Layers
from defras_sim.geometry import Pose
from defras_sim.held_motion import HeldMotion
from defras_sim.scene import Scene
from defras_sim.surface import Surface
from defras_sim.worlds.clock import TickClock
from defras_sim.worlds.error import WorldError
from defras_sim.worlds.force_sensor import NO_FORCE, measured_force_n
from defras_sim.worlds.jaw_contact import meets_tissue
from defras_sim.worlds.kinematic_tool import KinematicTool
from defras_sim.worlds.late import LateReadings
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

    The effects that the scene adopts are real here: tips go elsewhere than their encoders say,
    tissue slips and fades, the cloud is displaced and late. Equal scenes, commands and generators
    give equal runs.
    """

    name = "model"

    def __init__(self, scene: Scene, rng: np.random.Generator) -> None:
        """``scene`` is the actual one. ``rng`` makes the sensors' noise.

        Raises:
            WorldError: the tissue finds no equilibrium at rest.
            ValueError: the scene adopts what no tissue can have.
        """
        self.tick_s = scene.tick_s
        self._scene = scene
        layers = Layers.of(scene.model.extension)
        self._rng = rng
        self._clock = TickClock(scene.tick_s)
        self._command = HOLD
        self._closed = False
        self._tools = {
            arm: KinematicTool.at(np.array(part.home_tip_m)) for arm, part in scene.arms.items()
        }
        self._force_noise_sd_n: dict[str, float | None] = {
            arm: part.force_noise_sd_n for arm, part in scene.arms.items()
        }
        self._motion = HeldMotion(scene, layers)
        self._motion.follow({arm: tool.tissue_from_tip for arm, tool in self._tools.items()}, 0.0)
        self._camera = CameraLayer(scene.depth_camera, layers.camera)
        self._clouds = LateReadings[PointCloud](layers.delay_s, _restamped)
        self._tissue = ExtendedTissue(scene.simulated, layers.tissue)
        self._jaws: dict[str, Pose] = {}
        """Where the held patches were carried last."""
        self._state = self._tissue.solve({}, 0.0)
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
            tool.step(motion, self.tick_s, partial(self._on_tissue, arm))
            self._motion.follow({arm: tool.tissue_from_tip}, self.time_s)
            if tool.grasped and not held:
                self._tissue.grasp(arm, self._motion.take(arm, self.time_s))
            elif held and not tool.grasped:
                self._motion.let_go(arm)
                self._tissue.release(arm)
            changed |= tool.grasped != held
        self._command = HOLD
        jaws = self._motion.held(self.time_s, self._state.grasp_forces_n)
        changed |= any(not _equal(jaw, self._jaws.get(arm)) for arm, jaw in jaws.items())
        self._jaws = jaws
        if self._tissue.is_due(self.time_s) or changed:
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

    def _on_tissue(self, arm: str, tissue_from_tip: Pose) -> bool:
        self._motion.follow({arm: tissue_from_tip}, self.time_s)
        jaw = self._motion.jaw(arm, self.time_s)
        return meets_tissue(self._state.surface, jaw.position_m)

    def _settle(self) -> None:
        state = self._tissue.solve(self._jaws, self.time_s)
        if not state.converged:
            where = ", ".join(
                f"{arm} at {np.round(p.position_m, 4)} m" for arm, p in self._jaws.items()
            )
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
                cloud = PointCloud(self.time_s, self._camera.reported(points))
                self._clouds.add(self.time_s, cloud)
            if picture_due:
                seen = roi_visibility(scene, tissue)
                update = replace(update, roi_visibility=seen, roi_visibility_stamp_s=self.time_s)
        arrived = self._clouds.arrived(self.time_s)
        if arrived is not None:
            update = replace(update, cloud=arrived)
        self._latest = update

    def _read_arms(self) -> dict[str, ArmObservation]:
        return {arm: self._read_arm(arm, tool) for arm, tool in self._tools.items()}

    def _read_arm(self, arm: str, tool: KinematicTool) -> ArmObservation:
        noise = TIP_NOISE_SD_M * self._rng.standard_normal(3)
        return ArmObservation(
            stamp_s=self.time_s,
            tissue_from_tip=self._motion.measured(arm).moved(noise),
            setpoint_tissue_from_tip=tool.tissue_from_tip,
            jaw_rad=tool.jaw_rad,
            grasped=tool.grasped,
            force_n=measured_force_n(
                self._force_noise_sd_n[arm],
                self._state.grasp_forces_n.get(arm, NO_FORCE),
                self._rng,
            ),
        )


def _restamped(cloud: PointCloud, stamp_s: float) -> PointCloud:
    return PointCloud(stamp_s, cloud.points_m)


def _equal(one: Pose, other: Pose | None) -> bool:
    return one is other or (
        other is not None
        and np.array_equal(one.position_m, other.position_m)
        and np.array_equal(one.rotation, other.rotation)
    )
