"""Where arms and cameras stand around the tissue: the registration file."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from io import StringIO
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, field_validator
from ruamel.yaml import YAML
from scipy.spatial.transform import Rotation

from defras_bt.dvrk.registering.rigid_fit import RigidFit
from defras_bt.recording.whole_file import write_whole
from defras_sim.geometry import Pose
from defras_sim.scene_parts import ArmName, Part
from defras_sim.yaml_source import read_yaml

CameraName = Literal["depth", "endoscope"]
Metres = Annotated[float, Field(ge=-5, le=5)]
Distance = Annotated[float, Field(ge=0)]
_ROUNDING = 1e-3


class Placed(Part):
    """A frame in the tissue frame: its origin (m) and its rotation as a quaternion x, y, z, w.

    ``landmarks`` and what they are off by are of the fit that it was measured by.
    """

    position_m: tuple[Metres, Metres, Metres]
    quaternion_xyzw: tuple[float, float, float, float]
    landmarks: Annotated[int, Field(ge=0)] = 0
    rms_m: Distance | None = None
    left_out_m: Distance | None = None

    @field_validator("quaternion_xyzw")
    @classmethod
    def _unit(
        cls, quaternion: tuple[float, float, float, float]
    ) -> tuple[float, float, float, float]:
        length = float(np.linalg.norm(quaternion))
        if abs(length - 1.0) > _ROUNDING:
            raise ValueError(f"a rotation is a quaternion of length 1, this one's is {length:.4g}")
        return quaternion

    @property
    def pose(self) -> Pose:
        """tissue_from_frame."""
        turn = Rotation.from_quat(self.quaternion_xyzw).as_matrix()
        return Pose(np.array(self.position_m), turn)

    def moved_to(self, pose: Pose) -> Placed:
        """The same frame with another tissue_from_frame, measured as this one was."""
        there = Placed.of(pose)
        return self.model_copy(
            update={
                "position_m": there.position_m,
                "quaternion_xyzw": there.quaternion_xyzw,
            }
        )

    @staticmethod
    def of(pose: Pose, fit: RigidFit | None = None) -> Placed:
        """The frame whose tissue_from_frame is ``pose``; ``fit`` is where it comes from."""
        x, y, z = (float(v) for v in pose.position_m)
        qx, qy, qz, qw = (float(v) for v in pose.quaternion_xyzw)
        if fit is None:
            return Placed(position_m=(x, y, z), quaternion_xyzw=(qx, qy, qz, qw))
        return Placed(
            position_m=(x, y, z),
            quaternion_xyzw=(qx, qy, qz, qw),
            landmarks=len(fit.residuals_m),
            rms_m=fit.rms_m,
            left_out_m=fit.worst_left_out_m,
        )


class Registration(Part):
    """tissue_from_base of each arm (the frame of its poses), tissue_from_camera of each camera.

    ``measured`` is when, ``scene`` for which patient; what moved since then is not registered.
    ``adopted``: the values of effects, by their name, that a diagnosis found and that moved arms or
    a camera since; they count from what was registered before, so never twice.
    """

    measured: datetime
    scene: str
    arms: dict[ArmName, Placed] = Field(default_factory=dict)
    cameras: dict[CameraName, Placed] = Field(default_factory=dict)
    adopted: dict[str, tuple[dict[str, float], ...]] = Field(default_factory=dict)

    def with_arm(self, arm: ArmName, placed: Placed, measured: datetime) -> Registration:
        update = {"arms": {**self.arms, arm: placed}, "measured": measured}
        return self.model_copy(update=update)

    def with_camera(self, camera: CameraName, placed: Placed, measured: datetime) -> Registration:
        update = {"cameras": {**self.cameras, camera: placed}, "measured": measured}
        return self.model_copy(update=update)

    def with_adopted(self, effect: str, values: Mapping[str, float]) -> Registration:
        told = {**self.adopted, effect: (*self.adopted.get(effect, ()), dict(values))}
        return self.model_copy(update={"adopted": told})


def read_registration(file: Path) -> Registration:
    """Read a registration file.

    Raises:
        InvalidFile: with every fault as file:line:column.
    """
    return read_yaml(file).validate(Registration)


def write_registration(registration: Registration, file: Path) -> None:
    """Write at once or not at all.

    Raises:
        OSError: it cannot be written.
    """
    text = StringIO()
    yaml = YAML()
    yaml.default_flow_style = None
    yaml.width = 100
    yaml.dump(registration.model_dump(mode="json", exclude_defaults=True), text)
    write_whole(file, text.getvalue())
