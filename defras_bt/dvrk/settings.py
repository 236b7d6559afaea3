"""The set-up file of a laboratory: how its dVRK is reached, named and limited.

::

    name: bench
    transport: {kind: ros1, master_uri: "http://localhost:11311"}
    arms:
      psm1: {name: PSM1, frame: PSM1_base}
      psm2: {name: PSM2, frame: PSM2_base}
    cameras:
      depth: {cloud: /depth_camera/points, frame: depth_camera}
      endoscope: {image: /endoscope/image, info: /endoscope/camera_info, frame: endoscope}
    registration: registration.yaml
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, field_validator, model_validator

from defras_bt.dvrk.camera_settings import Cameras
from defras_sim.arm.dh import WRIST_TO_TIP_M
from defras_sim.scene_parts import ArmName, Part
from defras_sim.yaml_source import read_yaml

Port = Annotated[int, Field(ge=1024, le=65535)]
Seconds = Annotated[float, Field(gt=0, le=10)]
Beside = Annotated[Path, Field(validate_default=True)]
_PORTS: dict[ArmName, int] = {"psm1": 48051, "psm2": 48052}


class Ros1Transport(Part):
    """ROS 1. ``own_address`` is how the robot's computer reaches this one."""

    kind: Literal["ros1"] = "ros1"
    master_uri: Annotated[str, Field(pattern=r"^https?://[^/:]+:\d+/?$")] = "http://localhost:11311"
    own_address: str | None = None

    @field_validator("master_uri")
    @classmethod
    def _has_a_port(cls, uri: str) -> str:
        port = int(uri.rstrip("/").rpartition(":")[2])
        if not 1 <= port <= 65535:
            raise ValueError(
                f"there is no port {port}; ports go from 1 to 65535, roscore's is 11311"
            )
        return uri


class Ros2Transport(Part):
    """ROS 2 of the sourced environment."""

    kind: Literal["ros2"] = "ros2"
    domain_id: Annotated[int, Field(ge=0, le=232)] = 0


class SocketTransport(Part):
    """JSON over UDP as sawSocketStreamer sends it: it streams to one port of ours per arm."""

    kind: Literal["socket"] = "socket"
    own_address: str = "127.0.0.1"
    ports: dict[ArmName, Port] = Field(default_factory=lambda: dict(_PORTS))


Transport = Annotated[Ros1Transport | Ros2Transport | SocketTransport, Field(discriminator="kind")]


class ArmSetup(Part):
    """One arm. ``name`` is that of its topics, ``frame`` the one its poses come in.

    ``reported``: the point that the driver calls the tip: the origin of the wrist's yaw axis
    ("wrist", as a dVRK does) or the point between the jaw's ends ("jaw"). ``jaw_length_m``: from
    the one to the other. ``closed_rad``: where the jaw is sent to grip. ``holds_above_rad``: a jaw
    that stays this much wider than it was sent has something between its ends.
    """

    name: Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_/]*$")]
    frame: str
    reported: Literal["wrist", "jaw"] = "wrist"
    jaw_length_m: Annotated[float, Field(gt=0, le=0.06)] = WRIST_TO_TIP_M
    closed_rad: Annotated[float, Field(ge=-0.35, le=0.1)] = 0.0
    holds_above_rad: Annotated[float, Field(ge=0.02, le=0.5)] = 0.08

    @property
    def reported_to_tip_m(self) -> float:
        """From the reported point to the tip, along the tip's z axis."""
        return self.jaw_length_m if self.reported == "wrist" else 0.0


class Stream(Part):
    """The stream of set-points, and the limits that nothing sent ever breaks.

    ``reach_speed_m_s``: how fast arms reach at most, whatever the scene says. A dVRK's joints are
    45 to 51 ms behind their commands (measured; arXiv 2406.07375): at 30 mm/s the tip is up to
    1.7 mm behind, 0.3 mm more for each period by which pose and set-point are apart, and an arm
    3 mm away from its set-point counts as one that does not follow.
    ``step_m``, ``step_rad``: farthest between two set-points that follow each other.
    ``watchdog_s``: so long after a command motion stops by itself. ``realtime_priority``: of the
    process that streams, 1 to 99 for the system's real-time scheduler, 0 for none; without it the
    usual one where the system grants it.
    """

    rate_hz: Annotated[float, Field(ge=100, le=1000)] = 100.0
    speed_m_s: Annotated[float, Field(gt=0, le=0.2)] = 0.06
    reach_speed_m_s: Annotated[float, Field(gt=0, le=0.2)] = 0.03
    acceleration_m_s2: Annotated[float, Field(gt=0, le=5)] = 1.0
    braking_m_s2: Annotated[float, Field(ge=0.2, le=50)] = 5.0
    turning_rad_s: Annotated[float, Field(gt=0, le=6)] = 1.0
    turning_rad_s2: Annotated[float, Field(gt=0, le=60)] = 10.0
    jaw_rad_s: Annotated[float, Field(gt=0, le=6)] = 2.0
    step_m: Annotated[float, Field(gt=0, le=0.002)] = 0.001
    step_rad: Annotated[float, Field(gt=0, le=0.1)] = 0.03
    watchdog_s: Annotated[float, Field(ge=0.02, le=0.5)] = 0.1
    realtime_priority: Annotated[int, Field(ge=0, le=99)] | None = None

    @property
    def period_s(self) -> float:
        """Nominal time between two set-points."""
        return 1.0 / self.rate_hz

    @model_validator(mode="after")
    def _consistent(self) -> Stream:
        if self.speed_m_s * self.period_s > self.step_m:
            raise ValueError(
                f"step_m {self.step_m} is less than one period's way at speed_m_s; at least "
                f"{self.speed_m_s * self.period_s:.4g} at {self.rate_hz:g} Hz"
            )
        return self


class Limits(Part):
    """What is too old, too late or too far to go on.

    ``arm_age_s``: of joint and pose messages. ``state_age_s``: of the operating state, None for
    drivers that publish it only when it changes. ``clock_offset_s``: between the robot's clock and
    this computer's. ``echo_m``: a set-point echoed this far from everything that was sent is
    somebody else's. ``following_m``: between measured and echoed pose. ``disk_free_mb``: for the
    recording.
    """

    arm_age_s: Seconds = 0.04
    state_age_s: Seconds | None = None
    camera_age_s: Seconds = 0.4
    clock_offset_s: Annotated[float, Field(gt=0, le=1)] = 0.02
    echo_m: Annotated[float, Field(gt=0, le=0.01)] = 0.0001
    echo_rad: Annotated[float, Field(gt=0, le=0.5)] = 0.05
    following_m: Annotated[float, Field(gt=0, le=0.02)] = 0.005
    residual_m: Annotated[float, Field(gt=0, le=0.02)] = 0.002
    disk_free_mb: Annotated[float, Field(ge=0)] = 500.0
    check_age_h: Annotated[float, Field(gt=0, le=168)] = 12.0


class Rates(Part):
    """How often messages should come, at least."""

    measured_hz: Annotated[float, Field(gt=0, le=5000)] = 100.0
    depth_hz: Annotated[float, Field(gt=0, le=200)] = 10.0
    endoscope_hz: Annotated[float, Field(gt=0, le=200)] = 10.0


class Setup(Part):
    """One laboratory's set-up. Read with :func:`load_setup`."""

    name: str
    transport: Transport = Ros1Transport()
    arms: dict[ArmName, ArmSetup]
    cameras: Cameras = Cameras()
    stream: Stream = Stream()
    limits: Limits = Limits()
    rates: Rates = Rates()
    registration: Beside = Path("registration.yaml")
    checked: Beside = Path("dvrk_check.json")

    @field_validator("registration", "checked")
    @classmethod
    def _beside(cls, file: Path, info: ValidationInfo) -> Path:
        """File names count from the folder of the set-up file."""
        folder = (info.context or {}).get("folder")
        return file if folder is None else Path(folder) / file

    @field_validator("arms")
    @classmethod
    def _some(cls, arms: dict[ArmName, ArmSetup]) -> dict[ArmName, ArmSetup]:
        names = [arm.name for arm in arms.values()]
        if not arms:
            raise ValueError("a set-up needs at least one arm: psm1 or psm2")
        if len(set(names)) < len(names):
            raise ValueError(f"two arms cannot have the same name: {', '.join(names)}")
        return arms

    def used_by(self, arms: Collection[ArmName]) -> Setup:
        """This set-up without arms that are not among a scene's ``arms``: they are not touched."""
        used = {name: arm for name, arm in self.arms.items() if name in arms}
        return self.model_copy(update={"arms": used})

    @property
    def fingerprint(self) -> str:
        """SHA-256 (hex) of everything that a check of the set-up depends on, file places aside."""
        content = self.model_dump(mode="json", exclude={"registration", "checked"})
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def load_setup(file: Path) -> Setup:
    """Read a set-up file.

    Raises:
        InvalidFile: with every fault as file:line:column.
    """
    return read_yaml(file).validate(Setup, context={"folder": file.parent})
