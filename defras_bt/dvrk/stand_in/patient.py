"""The patient under the stand-in's arms: a simulated world, told where the tips really are.

The arms' own imperfections are behind them by then, so the world's arms are perfect; grasps and
tissue keep the effects of the actual scene.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from defras_bt.dvrk.stand_in.imperfections import Imperfections
from defras_bt.dvrk.stand_in.ray_pictures import RayPictures
from defras_sim.camera.ray_caster import RayCaster
from defras_sim.effects import library
from defras_sim.effects.camera_layer import CameraLayer
from defras_sim.effects.layers import Layers
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Scene
from defras_sim.worlds.clock import TickClock
from defras_sim.worlds.late import LateReadings
from defras_sim.worlds.protocol import ArmCommand, CameraImage, Command, World

_OF_THE_PATIENT = ("tissue", "grasp")


@dataclass(frozen=True)
class TipTarget:
    """Where an arm's tip truly is at the end of a tick, and where its jaw is sent."""

    tissue_from_tip: Pose
    jaw_rad: float


@dataclass(frozen=True)
class ArmFeedback:
    """What the tissue does to an arm. ``force_n`` (3,): of the jaw on the tissue, true, tissue
    frame."""

    jaw_rad: float
    grasped: bool
    force_n: Floats


@dataclass(frozen=True)
class Pictures:
    """What the cameras have new after a tick."""

    depth: CameraImage | None = None
    endoscope: CameraImage | None = None


def patient_scene(actual: Scene, tick_s: float) -> Scene:
    """``actual`` as the patient's world runs it: with exact force sensors and perfect arms."""
    extension = {
        name: values
        for name, values in actual.model.extension.items()
        if library.effect(name).layer in _OF_THE_PATIENT
    }
    arms = {
        name: arm.model_copy(update={"force_noise_sd_n": 0.0}) for name, arm in actual.arms.items()
    }
    scene = actual.model_copy(update={"tick_s": tick_s, "arms": arms})
    return scene.extended(extension)


class Patient:
    """A world, one tick after the other."""

    def __init__(
        self, world: World, actual: Scene, imperfections: Imperfections, rng: np.random.Generator
    ) -> None:
        """``world`` runs :func:`patient_scene` of ``actual``; ``rng`` makes the cameras' noise."""
        layers = Layers.of({**actual.model.extension, **imperfections.extension})
        self.world = world
        self._actual = actual
        self._rng = rng
        self._at: dict[str, Pose] = {}
        self._clock = TickClock(world.tick_s)
        self._camera = CameraLayer(actual.depth_camera, layers.camera)
        self._late = LateReadings[CameraImage](layers.delay_s, _restamped)
        self._eyes: dict[str, RayPictures] = {}

    @property
    def time_s(self) -> float:
        """World time."""
        return self._clock.time_s

    def start_at(self, tips: Mapping[str, Pose]) -> None:
        """Where the tips (tissue_from_tip) count as being when the first tick begins."""
        self._at = dict(tips)

    def step(self, targets: Mapping[str, TipTarget]) -> Mapping[str, ArmFeedback]:
        """Let one tick pass in which the tips go straight to their targets.

        Raises:
            WorldError: the world cannot go on.
        """
        arms = {name: self._towards(name, target) for name, target in targets.items()}
        self.world.command(Command(arms))
        self.world.step()
        self._clock.tick()
        return self.feedback()

    def feedback(self) -> Mapping[str, ArmFeedback]:
        """What the tissue does to the arms now."""
        return {
            name: ArmFeedback(
                jaw_rad=seen.jaw_rad,
                grasped=bool(seen.grasped),
                force_n=np.zeros(3) if seen.force_n is None else seen.force_n,
            )
            for name, seen in self.world.observe().arms.items()
        }

    def pictures(self) -> Pictures:
        """Pictures that are due after this tick, as the cameras report them."""
        seen, now_s = self.world.observe(), self._clock.time_s
        scene = self._actual
        depth_due = self._clock.due(scene.depth_camera.period_s)
        endoscope_due = self._clock.due(scene.endoscope.period_s)
        depth = endoscope = None
        if seen.depth_image is not None or seen.endoscope_image is not None:
            depth = seen.depth_image if depth_due else None
            endoscope = seen.endoscope_image if endoscope_due else None
        elif depth_due or endoscope_due:
            surface = self.world.true_surface()
            if surface is None:
                raise RuntimeError(f"the {self.world.name} world shows nothing of its tissue")
            tissue = RayCaster(surface)
            if depth_due:
                depth = self._eye("depth").take(tissue, now_s, self._rng)
            if endoscope_due:
                endoscope = self._eye("endoscope").take(tissue, now_s, None)
        if depth is not None:
            self._late.add(now_s, self._camera.reported_image(depth))
        return Pictures(self._late.arrived(now_s), endoscope)

    def _eye(self, name: str) -> RayPictures:
        if name not in self._eyes:
            scene = self._actual
            camera = scene.depth_camera if name == "depth" else scene.endoscope
            self._eyes[name] = RayPictures(scene, camera)
        return self._eyes[name]

    def _towards(self, name: str, target: TipTarget) -> ArmCommand:
        before = self._at.get(name, target.tissue_from_tip)
        self._at[name] = after = target.tissue_from_tip
        turn = Rotation.from_matrix(after.rotation @ before.rotation.T).as_rotvec()
        tick_s = self.world.tick_s
        return ArmCommand(
            linear_m_s=(after.position_m - before.position_m) / tick_s,
            angular_rad_s=turn / tick_s,
            jaw_rad=target.jaw_rad,
        )


def _restamped(image: CameraImage, stamp_s: float) -> CameraImage:
    return CameraImage(
        stamp_s, image.rgb, image.depth_m, image.intrinsics, image.tissue_from_camera
    )
