"""BulletWorld: PyBullet's deformable tissue, two jointed arms, and rendered cameras.

Nothing is handed over that a real set-up would not have: pictures, joints, jaws, and forces where
there are sensors.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from defras_sim.effects.arm_layer import ArmLayer
from defras_sim.effects.camera_layer import CameraLayer
from defras_sim.effects.grasp_layer import GraspLayer
from defras_sim.effects.layers import Layers
from defras_sim.scene import Scene
from defras_sim.surface import Surface
from defras_sim.worlds.bullet_arm import BulletArm
from defras_sim.worlds.bullet_camera import take_picture
from defras_sim.worlds.bullet_effects import in_bullet
from defras_sim.worlds.bullet_tissue import CONTACT_MARGIN_M, BulletTissue
from defras_sim.worlds.clock import TickClock
from defras_sim.worlds.colours import BED, ROI
from defras_sim.worlds.error import WorldError
from defras_sim.worlds.force_sensor import measured_force_n
from defras_sim.worlds.jaw_contact import meets_tissue
from defras_sim.worlds.kinematic_tool import ARMED_ABOVE_RAD, JAW_ON_TISSUE_RAD
from defras_sim.worlds.late import LateReadings
from defras_sim.worlds.native_output import STDERR, without_native_output
from defras_sim.worlds.protocol import (
    HOLD,
    ArmCommand,
    ArmObservation,
    CameraImage,
    Command,
    Observation,
)

with without_native_output(STDERR):
    import pybullet
    from pybullet_utils.bullet_client import BulletClient

_ROI_DISC_M = 0.0002
_BED_HALF_M = 0.25
_BED_HALF_THICKNESS_M = 0.02
_EXPLODED_M = 1.0
_SETTLING_S = 1.0


class BulletWorld:
    """A dynamic reality for a scene. Equal scenes, commands and generators give equal runs."""

    name = "bullet"

    def __init__(self, scene: Scene, rng: np.random.Generator) -> None:
        """``scene`` is the actual one. ``rng`` makes the sensors' noise.

        Raises:
            CannotImitate: the scene adopts an effect that PyBullet's tissue cannot have.
        """
        layers = Layers.of(scene.model.extension)
        scene = in_bullet(scene, layers)
        self.tick_s = scene.tick_s
        self._scene = scene
        self._grasp_effects = layers.grasp
        self._camera = CameraLayer(scene.depth_camera, layers.camera)
        self._pictures = LateReadings[CameraImage](layers.delay_s, _restamped)
        self._rng = rng
        self._clock = TickClock(scene.tick_s)
        self._steps = max(1, round(scene.tick_s / scene.simulation.bullet_step_s))
        self._command = HOLD
        with without_native_output():
            self._client: Any = BulletClient(connection_mode=pybullet.DIRECT)
            self._client.resetSimulation(pybullet.RESET_USE_DEFORMABLE_WORLD)
            self._client.setGravity(0, 0, -scene.tissue.gravity_m_s2)
            self._client.setTimeStep(scene.tick_s / self._steps)
            self._lay_bed()
            self._tissue = BulletTissue(self._client, scene)
            self._arms = {
                name: BulletArm(
                    self._client,
                    name,
                    np.array(arm.rcm_m),
                    np.array(arm.home_tip_m),
                    ArmLayer(np.array(arm.rcm_m), layers.arm),
                )
                for name, arm in scene.arms.items()
            }
            if scene.tissue.gravity_m_s2 > 0:
                self._let_settle()
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
        command.require_valid(self._arms)
        self._command = command

    def step(self) -> None:
        """Let ``tick_s`` of world time pass.

        Raises:
            WorldError: the tissue exploded, or an arm was sent where it cannot go.
        """
        self._clock.tick()
        for name, arm in self._arms.items():
            arm.begin_tick(self._command.arms.get(name, ArmCommand()), self.tick_s, self.time_s)
            self._update_grip(arm)
        self._command = HOLD
        for number in range(1, self._steps + 1):
            for arm in self._arms.values():
                arm.drive(number / self._steps)
            self._client.stepSimulation()
        self._check_sound()
        self._sense()

    def true_force_n(self) -> float:
        return max(float(np.linalg.norm(a.force_on_tissue_n())) for a in self._arms.values())

    def true_surface(self) -> Surface:
        return self._tissue.surface()

    def close(self) -> None:
        if self._client is not None:
            self._client.disconnect()
            self._client = None

    def _update_grip(self, arm: BulletArm) -> None:
        """A jaw that closes from wide open on tissue takes it; one that opens lets go."""
        if arm.jaw_rad > ARMED_ABOVE_RAD:
            arm.armed = True
        if arm.anchors and arm.jaw_rad > JAW_ON_TISSUE_RAD + 1e-9:
            self._tissue.let_go(arm.anchors)
            arm.anchors, arm.held = [], None
        elif arm.armed and not arm.anchors and arm.jaw_rad <= JAW_ON_TISSUE_RAD:
            arm.armed = False
            held = GraspLayer(self._grasp_effects, self.time_s, arm.tip())
            jaw_m = held.taken.position_m
            if meets_tissue(self._tissue.surface(), jaw_m):
                nodes = self._tissue.patch_at(jaw_m)
                arm.held = held
                arm.anchors = self._tissue.grip(arm.grip, arm.carry(), nodes)
                arm.jaw_rad = JAW_ON_TISSUE_RAD

    def _let_settle(self) -> None:
        """Before the first tick tissue with weight comes to lie on its bed."""
        for _ in range(
            round(_SETTLING_S / self._client.getPhysicsEngineParameters()["fixedTimeStep"])
        ):
            self._client.stepSimulation()
        self._check_sound()

    def _check_sound(self) -> None:
        nodes_m = self._tissue.nodes_m()
        if not np.isfinite(nodes_m).all() or np.abs(nodes_m).max() > _EXPLODED_M:
            raise WorldError(
                f"at {self.time_s:.2f} s PyBullet's tissue became unstable; a smaller "
                "simulation.bullet_step_s, or a coarser bullet_elements_xyz, keeps it stable"
            )

    def _sense(self) -> None:
        """Read every sensor that is due; the others keep their last reading."""
        scene, time_s = self._scene, self.time_s
        arms: dict[str, ArmObservation] = {
            name: self._arms[name].observe(
                time_s,
                measured_force_n(
                    part.force_noise_sd_n, self._arms[name].force_on_tissue_n(), self._rng
                ),
            )
            for name, part in scene.arms.items()
        }
        update = replace(self._latest, time_s=time_s, arms=arms)
        if self._clock.due(scene.depth_camera.period_s):
            picture = take_picture(self._client, scene.depth_camera, time_s, self._rng)
            self._pictures.add(time_s, self._camera.reported_image(picture))
        arrived = self._pictures.arrived(time_s)
        if arrived is not None:
            update = replace(update, depth_image=arrived)
        if self._clock.due(scene.endoscope.period_s):
            picture = take_picture(self._client, scene.endoscope, time_s, None)
            update = replace(update, endoscope_image=picture)
        self._latest = update

    def _lay_bed(self) -> None:
        """The bed, which tissue cannot pass, and the region on it, which is only seen."""
        client, scene = self._client, self._scene
        size = [_BED_HALF_M, _BED_HALF_M, _BED_HALF_THICKNESS_M]
        # PyBullet keeps soft bodies a margin away from what they touch: the bed that is felt lies
        # that much lower than the bed that is meant.
        felt_m = -scene.tissue.thickness_m - CONTACT_MARGIN_M - _BED_HALF_THICKNESS_M
        shape = client.createCollisionShape(client.GEOM_BOX, halfExtents=size)
        drawn = client.createVisualShape(client.GEOM_BOX, halfExtents=size, rgbaColor=[*BED, 1])
        bed = client.createMultiBody(0, shape, drawn, [0, 0, felt_m])
        client.changeDynamics(bed, -1, lateralFriction=0.0)
        region = client.createVisualShape(
            client.GEOM_CYLINDER,
            radius=scene.roi.radius_m,
            length=_ROI_DISC_M,
            rgbaColor=[*ROI, 1],
        )
        client.createMultiBody(0, -1, region, list(scene.roi_center_m))


def _restamped(image: CameraImage, stamp_s: float) -> CameraImage:
    return replace(image, stamp_s=stamp_s)
