"""Pictures of a patient that has no renderer: rays against the tissue, the region and the bed."""

from __future__ import annotations

import numpy as np

from defras_sim.camera.pinhole import intrinsics, ray_directions, tissue_from_camera
from defras_sim.camera.ray_caster import RayCaster
from defras_sim.geometry import Floats
from defras_sim.scene import Camera, Scene
from defras_sim.worlds.colours import BED, ROI, TISSUE
from defras_sim.worlds.protocol import CameraImage

_BED_HALF_M = 0.25
_BACKGROUND = (0.02, 0.02, 0.02)


class RayPictures:
    """Takes pictures with one camera. Instruments are not in them."""

    def __init__(self, scene: Scene, camera: Camera) -> None:
        self._scene = scene
        self._camera = camera
        columns, rows = np.meshgrid(np.arange(camera.width_px), np.arange(camera.height_px))
        pixels = np.column_stack([columns.ravel(), rows.ravel()]).astype(float)
        self._rays = ray_directions(camera, pixels)
        self._origin_m = np.array(camera.position_m)
        floor_m = float(scene.roi_center_m[2])
        with np.errstate(divide="ignore"):
            depth_m = (floor_m - self._origin_m[2]) / self._rays[:, 2]
        at_m = (self._origin_m + depth_m[:, None] * self._rays)[:, :2]
        on_bed = (depth_m > 0.0) & (np.abs(at_m) < _BED_HALF_M).all(axis=1)
        in_roi = np.linalg.norm(at_m - scene.roi_center_m[:2], axis=1) <= scene.roi.radius_m
        self._floor_m = np.where(on_bed, depth_m, np.nan)
        floor = np.where(on_bed[:, None], _bytes(BED), _bytes(_BACKGROUND))
        self._floor_rgb = np.where((on_bed & in_roi)[:, None], _bytes(ROI), floor)

    def take(
        self, tissue: RayCaster, time_s: float, rng: np.random.Generator | None
    ) -> CameraImage:
        """A colour picture; with ``rng`` also depth, with the camera's noise along the axis."""
        shape = (self._camera.height_px, self._camera.width_px)
        hit_m = tissue.hits(self._origin_m, self._rays)
        hit = np.isfinite(hit_m)
        rgb = np.where(hit[:, None], _bytes(TISSUE), self._floor_rgb).astype(np.uint8)
        depth_m: Floats | None = None
        if rng is not None:
            exact_m = np.where(hit, hit_m, self._floor_m)
            noise_m = self._camera.noise_sd_m * rng.standard_normal(len(exact_m))
            depth_m = (exact_m + noise_m).reshape(shape)
        return CameraImage(
            stamp_s=time_s,
            rgb=rgb.reshape(*shape, 3),
            depth_m=depth_m,
            intrinsics=intrinsics(self._camera),
            tissue_from_camera=tissue_from_camera(self._camera),
        )


def _bytes(colour: tuple[float, float, float]) -> Floats:
    return np.round(255 * np.array(colour))
