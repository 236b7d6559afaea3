"""Hidden mismatches of a retraction: what really happens while the twin believes something else."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from defras_sim.geometry import Floats, Pose
from defras_sim.retraction import arm_for
from defras_sim.scene import ArmName, GraspPoint, Scene
from defras_sim.twin import Twin
from defras_sim.worlds.kinematic_tool import POINTING_DOWN

Mask = NDArray[np.bool_]

KINDS = ("extra", "missing", "torn", "slip", "camera", "second_tool")
"""In the order in which they are reported."""


class Mismatch(Protocol):
    """One thing that is otherwise than believed. Frames count from the first after the grasp."""

    @property
    def kind(self) -> str: ...

    @property
    def starts(self) -> int:
        """The first frame at which anything differs."""
        ...

    def actual(self, believed: Scene) -> Scene:
        """The scene that is there from the beginning."""
        ...

    def tips(self, frame: int, tips: dict[str, Pose]) -> dict[str, Pose]:
        """Where the tissue is really held when the arms are at ``tips``."""
        ...

    def happen(self, frame: int, world: Twin) -> None:
        """What happens to the tissue just before a frame."""

    def camera(self, frame: int) -> Pose:
        """Maps a place to where the camera reports it."""
        ...


@dataclass(frozen=True)
class _Nothing:
    """A base: nothing differs."""

    kind: str
    starts: int = 0

    def actual(self, believed: Scene) -> Scene:
        return believed

    def tips(self, frame: int, tips: dict[str, Pose]) -> dict[str, Pose]:
        return tips

    def happen(self, frame: int, world: Twin) -> None:
        """Nothing happens."""

    def camera(self, frame: int) -> Pose:
        return Pose(np.zeros(3))


@dataclass(frozen=True)
class OtherAttachments(_Nothing):
    """``attached`` (holes,) hold in truth: from the beginning, or (torn) from ``starts`` on."""

    attached: tuple[bool, ...] = ()

    def actual(self, believed: Scene) -> Scene:
        return believed if self.kind == "torn" else believed.with_attached(np.array(self.attached))

    def happen(self, frame: int, world: Twin) -> None:
        if self.kind == "torn" and frame == self.starts:
            world.set_attached(np.array(self.attached))


@dataclass(frozen=True)
class Slip(_Nothing):
    """The jaw slides over the tissue: what it holds stays behind by ``slid_m`` (3,), soon."""

    slid_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    frames: int = 3

    def tips(self, frame: int, tips: dict[str, Pose]) -> dict[str, Pose]:
        share = np.clip((frame - self.starts + 1) / self.frames, 0.0, 1.0)
        return {arm: tip.moved(share * np.array(self.slid_m)) for arm, tip in tips.items()}


@dataclass(frozen=True)
class CameraShift(_Nothing):
    """Somebody knocks against the camera: all it reports is moved from ``starts`` on."""

    moved_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turned_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def camera(self, frame: int) -> Pose:
        if frame < self.starts:
            return Pose(np.zeros(3))
        return Pose(np.array(self.moved_m), Rotation.from_rotvec(self.turned_rad).as_matrix())


@dataclass(frozen=True)
class SecondTool(_Nothing):
    """An instrument that nobody told of takes the tissue at ``point_m`` and moves it."""

    arm: ArmName = "psm2"
    point_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    moved_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    frames: int = 10

    def _tip(self, frame: int) -> Pose:
        share = np.clip((frame - self.starts) / self.frames, 0.0, 1.0)
        return Pose(np.array(self.point_m) + share * np.array(self.moved_m), POINTING_DOWN)

    def happen(self, frame: int, world: Twin) -> None:
        if frame == self.starts:
            world.grasp(self.arm, self._tip(frame))

    def tips(self, frame: int, tips: dict[str, Pose]) -> dict[str, Pose]:
        return tips if frame < self.starts else {**tips, self.arm: self._tip(frame)}


def draw_mismatch(
    kind: str, scene: Scene, point: GraspPoint, frames: int, rng: np.random.Generator
) -> Mismatch | None:
    """A mismatch of ``kind`` in a retraction of ``frames`` frames that grasps at ``point``.

    None where the scene has no room for one.
    """
    starts = int(rng.integers(2, max(3, frames - 10)))
    if kind in ("extra", "missing", "torn"):
        attached = _other_attachments(kind, scene, point, rng)
        if attached is None:
            return None
        return OtherAttachments(kind, starts if kind == "torn" else 0, attached)
    if kind == "slip":
        return Slip(kind, starts, _vector(rng, 0.003, 0.015, down=True))
    if kind == "camera":
        moved = _vector(rng, 0.001, 0.009)
        return CameraShift(kind, starts, moved, _vector(rng, 0.0, 0.05))
    arm: ArmName = "psm2" if arm_for(scene, point) == "psm1" else "psm1"
    far = [
        place
        for place in scene.grasp_points
        if arm in scene.arms_at(*place)
        and np.linalg.norm(scene.grasp_point_m(*place) - scene.grasp_point_m(*point)) > 0.04
    ]
    if not far:
        return None
    x, y, z = scene.grasp_point_m(*far[rng.integers(len(far))])
    # Taken early, while that place still lies as it did at rest.
    starts = min(starts, 3)
    moved = _vector(rng, 0.003, 0.02, up=True)
    return SecondTool(kind, starts, arm, (float(x), float(y), float(z)), moved)


def _other_attachments(
    kind: str, scene: Scene, point: GraspPoint, rng: np.random.Generator
) -> tuple[bool, ...] | None:
    """Holes within a disc of 8 to 25 mm are otherwise than believed; not right under the jaw."""
    attached, holes_m = scene.attached, scene.holes_xy_m
    clear = np.linalg.norm(holes_m - scene.grasp_xy_m(*point), axis=1) > 0.015
    could = scene.is_hole & clear & (~attached if kind == "extra" else attached)
    if not could.any():
        return None
    centre_m = holes_m[rng.choice(np.flatnonzero(could))]
    near = np.linalg.norm(holes_m - centre_m, axis=1) <= rng.uniform(0.008, 0.025)
    other = np.where(near & could, kind == "extra", attached)
    if not other.any():
        return None
    return tuple(bool(hold) for hold in other)


def _vector(
    rng: np.random.Generator, least: float, most: float, *, up: bool = False, down: bool = False
) -> tuple[float, float, float]:
    """Of random direction (in the upper or lower half space), from ``least`` to ``most`` long."""
    way: Floats = rng.normal(size=3)
    way *= rng.uniform(least, most) / np.linalg.norm(way)
    if up or down:
        way[2] = abs(way[2]) if up else -abs(way[2])
    return float(way[0]), float(way[1]), float(way[2])
