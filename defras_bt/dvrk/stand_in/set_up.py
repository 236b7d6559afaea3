"""The set-up, registration and scene files with which a laboratory would reach the stand-in."""

from __future__ import annotations

from datetime import datetime
from io import StringIO
from pathlib import Path

import numpy as np
from ruamel.yaml import YAML

from defras_bt.dvrk.camera_settings import Cameras, DepthCamera, Endoscope
from defras_bt.dvrk.registering.registration import Placed, Registration, write_registration
from defras_bt.dvrk.settings import ArmSetup, Ros1Transport, Setup
from defras_bt.dvrk.stand_in.camera_topics import (
    CLOUD,
    DEPTH_FRAME,
    ENDOSCOPE,
    ENDOSCOPE_FRAME,
    ENDOSCOPE_INFO,
)
from defras_bt.dvrk.stand_in.imperfections import Imperfections
from defras_bt.recording.whole_file import write_whole
from defras_sim.camera.pinhole import tissue_from_camera
from defras_sim.effects.layers import Layers
from defras_sim.geometry import Pose
from defras_sim.scene import Scene
from defras_sim.scene_file import write_scene

SETUP_FILE, REGISTRATION_FILE, SCENE_FILE = "dvrk.yaml", "registration.yaml", "scene.yaml"


def set_up_of(master_uri: str, scene: Scene) -> Setup:
    """How the stand-in is reached and named."""
    arms = {name: ArmSetup(name=name.upper(), frame=f"{name.upper()}_base") for name in scene.arms}
    cameras = Cameras(
        depth=DepthCamera(frame=DEPTH_FRAME, cloud=CLOUD),
        endoscope=Endoscope(frame=ENDOSCOPE_FRAME, image=ENDOSCOPE, info=ENDOSCOPE_INFO),
    )
    return Setup(
        name="stand-in",
        transport=Ros1Transport(master_uri=master_uri),
        arms=arms,
        cameras=cameras,
    )


def registration_of(scene: Scene, imperfections: Imperfections, measured: datetime) -> Registration:
    """What registering the stand-in gave: exact but for what is imperfect about it.

    The arms' error is in the arms themselves (``tool_offset``); the depth camera's is here
    (``camera_registration``), because pictures do not change where a camera stands.
    """
    placed = Pose(np.zeros(3))
    for effect, values in Layers.of(imperfections.extension).camera:
        placed = effect.placement(values, scene.depth_camera) @ placed
    depth = placed @ tissue_from_camera(scene.depth_camera)
    return Registration(
        measured=measured,
        scene=scene.name,
        arms={name: Placed.of(Pose(np.array(arm.rcm_m))) for name, arm in scene.arms.items()},
        cameras={
            "depth": Placed.of(depth),
            "endoscope": Placed.of(tissue_from_camera(scene.endoscope)),
        },
    )


def write_set_up(folder: Path, setup: Setup, registration: Registration, belief: Scene) -> Path:
    """Write the files into ``folder``; returns the set-up file.

    Raises:
        OSError: they cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    text = StringIO()
    plain = setup.model_dump(mode="json", exclude_defaults=True)
    plain["transport"] = setup.transport.model_dump(mode="json", exclude_none=True)
    YAML().dump(plain, text)
    write_whole(folder / SETUP_FILE, text.getvalue())
    write_registration(registration, folder / REGISTRATION_FILE)
    write_scene(belief, folder / SCENE_FILE)
    return folder / SETUP_FILE
