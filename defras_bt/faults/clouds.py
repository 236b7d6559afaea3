"""Faults of what the depth camera sees: another unit, frame, place, density or noise; a repeat."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from defras_bt.faults.fault import Fault, Injector
from defras_bt.monitoring.metric_track import CONFIRMING_FRAMES
from defras_bt.sensing.sense import MIN_CLOUD_POINTS
from defras_sim.camera.pinhole import tissue_from_camera
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Scene, Vector
from defras_sim.worlds.protocol import CameraImage, Observation, PointCloud


class CloudFault(Fault):
    """Base: changes each new cloud, or the depth picture that clouds are made of."""

    def injector(self, scene: Scene, rng: np.random.Generator) -> Injector:
        return CloudInjector(self, scene, rng)

    def changed_m(self, points_m: Floats, scene: Scene, rng: np.random.Generator) -> Floats:
        """The points (n, 3) that arrive."""
        raise NotImplementedError

    def changed_picture(
        self, picture: CameraImage, scene: Scene, rng: np.random.Generator
    ) -> CameraImage:
        """The depth picture that arrives; by default each pixel's point is changed."""
        if picture.depth_m is None:
            return picture
        rows, columns = np.indices(picture.depth_m.shape)
        pixels = np.stack([columns, rows, np.ones_like(rows)], axis=-1).reshape(-1, 3)
        rays = pixels @ np.linalg.inv(picture.intrinsics).T
        seen_m = picture.tissue_from_camera.apply(rays * picture.depth_m.reshape(-1, 1))
        moved_m = picture.tissue_from_camera.inverse().apply(self.changed_m(seen_m, scene, rng))
        return replace(picture, depth_m=moved_m[:, 2].reshape(picture.depth_m.shape))

    def must_hold(self, frames: int, holding: bool) -> bool:
        """Whether it must keep the arms still once ``frames`` changed frames arrived in a row."""
        return True


class CloudInjector(Injector):
    """Changes each cloud once, however many ticks it stays the latest."""

    _fault: CloudFault

    def __init__(self, fault: CloudFault, scene: Scene, rng: np.random.Generator) -> None:
        super().__init__(fault, rng)
        self._scene = scene
        self._true: tuple[PointCloud | None, CameraImage | None] = (None, None)
        self._made: tuple[PointCloud | None, CameraImage | None] = (None, None)
        self._changed = False
        self._frames = 0
        self._holding: frozenset[str] = frozenset()

    def observed(self, true: Observation, delivered: Observation) -> Observation:
        holding = frozenset(name for name, arm in true.arms.items() if arm.grasped)
        if holding != self._holding:
            self._holding, self._frames = holding, 0
        cloud, picture = delivered.cloud, delivered.depth_image
        if cloud is not self._true[0] or picture is not self._true[1]:
            self._true = self._made = (cloud, picture)
            self._changed = self.happens(true.time_s)
            self._frames = self._frames + 1 if self._changed else 0
            if self._changed:
                self._made = (self._with_points(cloud), self._with_depth(picture))
        trips = self._changed and self._fault.must_hold(self._frames, bool(holding))
        self.trip = f"the cloud is {self._fault.kind}" if trips else ""
        return replace(delivered, cloud=self._made[0], depth_image=self._made[1])

    def _with_points(self, cloud: PointCloud | None) -> PointCloud | None:
        if cloud is None:
            return None
        return replace(
            cloud, points_m=self._fault.changed_m(cloud.points_m, self._scene, self._rng)
        )

    def _with_depth(self, picture: CameraImage | None) -> CameraImage | None:
        if picture is None:
            return None
        return self._fault.changed_picture(picture, self._scene, self._rng)


class WrongUnit(CloudFault):
    """The cloud comes in another unit, by default in millimetres."""

    kind: ClassVar[str] = "wrong_unit"
    factor: Annotated[float, Field(gt=0)] = 1000.0

    def changed_m(self, points_m: Floats, scene: Scene, rng: np.random.Generator) -> Floats:
        return points_m * self.factor

    def changed_picture(
        self, picture: CameraImage, scene: Scene, rng: np.random.Generator
    ) -> CameraImage:
        if picture.depth_m is None:
            return picture
        return replace(picture, depth_m=picture.depth_m * self.factor)


class WrongFrame(CloudFault):
    """The cloud comes in the camera's frame instead of the tissue's."""

    kind: ClassVar[str] = "wrong_frame"

    def changed_m(self, points_m: Floats, scene: Scene, rng: np.random.Generator) -> Floats:
        return tissue_from_camera(scene.depth_camera).inverse().apply(points_m)

    def changed_picture(
        self, picture: CameraImage, scene: Scene, rng: np.random.Generator
    ) -> CameraImage:
        return replace(picture, tissue_from_camera=Pose(np.zeros(3)))


class Displaced(CloudFault):
    """The camera was bumped: everything it sees is ``offset_m`` away from where it is."""

    kind: ClassVar[str] = "displaced"
    offset_m: Vector = (0.0, 0.0, 0.012)

    def changed_m(self, points_m: Floats, scene: Scene, rng: np.random.Generator) -> Floats:
        return points_m + np.array(self.offset_m)

    def changed_picture(
        self, picture: CameraImage, scene: Scene, rng: np.random.Generator
    ) -> CameraImage:
        moved = picture.tissue_from_camera.moved(np.array(self.offset_m))
        return replace(picture, tissue_from_camera=moved)

    def must_hold(self, frames: int, holding: bool) -> bool:
        return holding and frames >= CONFIRMING_FRAMES


class Sparse(CloudFault):
    """Hardly anything is seen: smoke, a covered lens, a mirror-like surface."""

    kind: ClassVar[str] = "sparse"
    points: Annotated[int, Field(ge=0, le=MIN_CLOUD_POINTS - 1)] = 5

    def changed_m(self, points_m: Floats, scene: Scene, rng: np.random.Generator) -> Floats:
        chosen = rng.permutation(len(points_m))[: self.points]
        return points_m[np.sort(chosen)]

    def changed_picture(
        self, picture: CameraImage, scene: Scene, rng: np.random.Generator
    ) -> CameraImage:
        if picture.depth_m is None:
            return picture
        return replace(picture, depth_m=np.full_like(picture.depth_m, np.nan))


class Noisy(CloudFault):
    """The camera measures with far more noise than it should."""

    kind: ClassVar[str] = "noisy"
    noise_sd_m: Annotated[float, Field(gt=0)] = 0.004

    def changed_m(self, points_m: Floats, scene: Scene, rng: np.random.Generator) -> Floats:
        return points_m + self.noise_sd_m * rng.standard_normal(points_m.shape)

    def must_hold(self, frames: int, holding: bool) -> bool:
        return False  # how much noise looks like another shape, only the metrics can say


class Repeated(Fault):
    """The camera hangs, and its driver sends the last cloud again and again as if it were new."""

    kind: ClassVar[str] = "repeated"

    def injector(self, scene: Scene, rng: np.random.Generator) -> Injector:
        return _Repeated(self, scene, rng)


class _Repeated(Injector):
    def __init__(self, fault: Fault, scene: Scene, rng: np.random.Generator) -> None:
        super().__init__(fault, rng)
        self._max_age_s = scene.thresholds.max_age_s
        self._kept: Observation | None = None

    def observed(self, true: Observation, delivered: Observation) -> Observation:
        self.trip = ""
        if not self._fault.active(true.time_s):
            self._kept = None
            return delivered
        kept = self._kept = self._kept or true
        cloud, picture = kept.cloud, kept.depth_image
        taken_s = [reading.stamp_s for reading in (cloud, picture) if reading is not None]
        if taken_s and true.time_s - max(taken_s) > self._max_age_s + 1e-6:
            self.trip = "the cloud repeats itself"
        if cloud is not None and true.cloud is not None:
            cloud = replace(cloud, stamp_s=true.cloud.stamp_s)
        if picture is not None and true.depth_image is not None:
            picture = replace(picture, stamp_s=true.depth_image.stamp_s)
        return replace(delivered, cloud=cloud, depth_image=picture)
