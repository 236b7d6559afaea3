"""Topic map: where in a laboratory's bag each reading stands, in which unit, frame and clock.

Example::

    arms:
      psm1:
        setpoint: {topic: /dvrk/PSM1/setpoint_cp, frame: psm1_base}
        measured: {topic: /dvrk/PSM1/measured_cp, frame: psm1_base}
        jaw: {topic: /dvrk/PSM1/jaw/measured_js, unit: deg}
        force: {topic: /ati/wrench, frame: psm1_base}
    cloud: {topic: /camera/points, unit: mm, frame: camera, clock_offset_s: -0.03}
    frames:
      psm1_base: {position_m: [0.1, 0.0, 0.2], quaternion_xyzw: [0, 0, 0, 1]}
      camera: {position_m: [0.17, 0.0, 0.2], quaternion_xyzw: [0.7, 0.7, 0, 0]}
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, field_validator
from scipy.spatial.transform import Rotation

from defras_sim.geometry import Pose
from defras_sim.scene import Part
from defras_sim.scene_parts import ArmName
from defras_sim.yaml_source import InvalidFile, read_yaml

TISSUE_FRAME = "tissue"


class _Source(Part):
    """A topic. ``clock_offset_s`` is added to its stamps; ``frame`` replaces that of its header."""

    topic: Annotated[str, Field(min_length=1)]
    frame: str | None = None
    clock_offset_s: Annotated[float, Field(ge=-1e10, le=1e10)] = 0.0


class LengthSource(_Source):
    """Poses, points. ``tip_beyond_m``: how far the jaw's tip lies beyond the point that poses are
    given of, along their z axis; a dVRK gives the origin of the wrist's yaw axis."""

    unit: Literal["m", "mm"] = "m"
    tip_beyond_m: Annotated[float, Field(ge=-0.1, le=0.1)] = 0.0

    @property
    def scale(self) -> float:
        """Metres per unit."""
        return {"m": 1.0, "mm": 1e-3}[self.unit]


class AngleSource(_Source):
    """Joint positions; those of a prismatic joint are in metres either way."""

    unit: Literal["rad", "deg"] = "rad"

    @property
    def scale(self) -> float:
        """Radians per unit."""
        return {"rad": 1.0, "deg": np.pi / 180}[self.unit]


class ForceSource(_Source):
    """Wrenches: what the jaw exerts on the tissue, or with ``reaction`` what it bears."""

    unit: Literal["N", "mN"] = "N"
    reaction: bool = False

    @property
    def scale(self) -> float:
        """Newtons on the tissue per unit."""
        return {"N": 1.0, "mN": 1e-3}[self.unit] * (-1.0 if self.reaction else 1.0)


class FlagSource(_Source):
    """Booleans."""


def _topic(given: Any) -> Any:
    """A bare string is a topic with all else as usual."""
    return {"topic": given} if isinstance(given, str) else given


Length = Annotated[LengthSource, BeforeValidator(_topic)]
Angle = Annotated[AngleSource, BeforeValidator(_topic)]
Force = Annotated[ForceSource, BeforeValidator(_topic)]
Flag = Annotated[FlagSource, BeforeValidator(_topic)]


class ArmTopics(Part):
    """One arm. Where nothing publishes set-points, ``setpoint`` may name the measured topic; the
    arm's own errors are then out of sight. Without ``grasped`` the jaw tells."""

    setpoint: Length
    measured: Length | None = None
    joints: Angle | None = None
    setpoint_joints: Angle | None = None
    jaw: Angle | None = None
    grasped: Flag | None = None
    force: Force | None = None


class FramePlace(Part):
    """tissue_from_frame."""

    position_m: tuple[float, float, float]
    quaternion_xyzw: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)

    @field_validator("quaternion_xyzw")
    @classmethod
    def _of_unit_length(
        cls, given: tuple[float, float, float, float]
    ) -> tuple[float, float, float, float]:
        length = float(np.linalg.norm(given))
        if abs(length - 1.0) > 0.01:
            raise ValueError(f"a quaternion has length 1; this one has {length:.3g}")
        return given

    @property
    def tissue_from_frame(self) -> Pose:
        return Pose(np.array(self.position_m), Rotation.from_quat(self.quaternion_xyzw).as_matrix())


class JawAngles(Part):
    """A jaw that closes below ``closed_below_rad`` after it was wider than ``open_above_rad``
    takes tissue, and holds it until it is wider than the latter again."""

    closed_below_rad: Annotated[float, Field(gt=0, lt=2)] = 0.25
    open_above_rad: Annotated[float, Field(gt=0, lt=2)] = 0.5


class TopicMap(Part):
    """Everything a recording can hold. ``stamps``: whether times are those of the headers, or when
    messages were received (for clocks that cannot be trusted)."""

    arms: Annotated[dict[ArmName, ArmTopics], Field(min_length=1)]
    cloud: Length
    visibility: Flag | None = None
    frames: dict[str, FramePlace] = Field(default_factory=dict)
    jaw: JawAngles = JawAngles()
    stamps: Literal["header", "received"] = "header"

    @property
    def topics(self) -> frozenset[str]:
        """Every topic that the map names."""
        sources: list[_Source | None] = [self.cloud, self.visibility]
        for arm in self.arms.values():
            sources += [arm.setpoint, arm.measured, arm.joints, arm.setpoint_joints]
            sources += [arm.jaw, arm.grasped, arm.force]
        return frozenset(source.topic for source in sources if source is not None)


def read_topic_map(file: Path) -> TopicMap:
    """Read a topic map.

    Raises:
        InvalidFile: with every fault as file:line:column.
    """
    source = read_yaml(file)
    found = source.validate(TopicMap)
    if found.jaw.closed_below_rad >= found.jaw.open_above_rad:
        raise InvalidFile(
            [source.fault(("jaw",), "jaw: closed_below_rad should be less than open_above_rad")]
        )
    return found


def own_topics(arms: tuple[ArmName, ...]) -> TopicMap:
    """The topics that ``defras run`` writes, which are also those of the CRTK convention."""

    def of(arm: str) -> ArmTopics:
        root = f"/{arm.upper()}"
        return ArmTopics(
            setpoint=LengthSource(topic=f"{root}/setpoint_cp"),
            measured=LengthSource(topic=f"{root}/measured_cp"),
            joints=AngleSource(topic=f"{root}/measured_js"),
            setpoint_joints=AngleSource(topic=f"{root}/setpoint_js"),
            jaw=AngleSource(topic=f"{root}/jaw/measured_js"),
            grasped=FlagSource(topic=f"{root}/grasped"),
            force=ForceSource(topic=f"{root}/body/measured_cf"),
        )

    return TopicMap(
        arms={arm: of(arm) for arm in arms},
        cloud=LengthSource(topic="/tissue/points"),
        visibility=FlagSource(topic="/endoscope/roi_visibility"),
    )
