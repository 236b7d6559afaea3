"""How much of the region of interest the endoscope's picture shows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from defras_bt.sensing.colours import ColourCalibration
from defras_sim.scene import Scene
from defras_sim.worlds.protocol import CameraImage


def roi_visibility(image: CameraImage, scene: Scene, colours: ColourCalibration) -> float:
    """Visible pixels of the region over those of the unobstructed disc, 0..1.

    Pixels of the region's colour count within one pixel around the place where the disc of known
    size must appear, so that a stray reflection elsewhere exposes nothing. A part of the disc
    outside the picture counts as hidden.

    Raises:
        ValueError: the disc is behind the camera or smaller than one pixel.
    """
    height, width = image.rgb.shape[:2]
    disc, first_row, first_column = _disc_pixels(image, scene)
    expected = int(disc.sum())
    if expected == 0:
        raise ValueError(
            "the region of interest covers no pixel of the endoscope's picture, even unobstructed"
        )
    around = np.zeros((height, width), bool)
    rows, columns = np.nonzero(ndimage.binary_dilation(np.pad(disc, 1), np.ones((3, 3), bool)))
    rows, columns = rows + first_row - 1, columns + first_column - 1
    inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
    around[rows[inside], columns[inside]] = True
    visible = int((colours.roi.mask(image.rgb) & around).sum())
    return float(np.clip(visible / expected, 0.0, 1.0))


def _disc_pixels(image: CameraImage, scene: Scene) -> tuple[NDArray[np.bool_], int, int]:
    """Pixels whose ray meets the disc: a mask, and the picture row and column of its corner.

    The mask reaches beyond the picture where the disc does.
    """
    angles = np.linspace(0.0, 2 * np.pi, 64, endpoint=False)
    center = scene.roi_center_m
    circle = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(64)])
    rim = image.tissue_from_camera.inverse().apply(center + scene.roi.radius_m * circle)
    if np.any(rim[:, 2] <= 0.0):
        raise ValueError("the region of interest is not in front of the endoscope")
    pixels = (rim / rim[:, 2:]) @ image.intrinsics.T
    low = np.floor(pixels.min(axis=0)[:2]).astype(int)
    high = np.ceil(pixels.max(axis=0)[:2]).astype(int)
    columns, rows = np.meshgrid(np.arange(low[0], high[0] + 1), np.arange(low[1], high[1] + 1))
    homogeneous = np.stack([columns, rows, np.ones_like(rows)], axis=-1)
    rays = homogeneous @ np.linalg.inv(image.intrinsics).T @ image.tissue_from_camera.rotation.T
    origin = image.tissue_from_camera.position_m
    on_plane = origin + rays * ((center[2] - origin[2]) / rays[..., 2])[..., None]
    disc = np.linalg.norm(on_plane - center, axis=-1) <= scene.roi.radius_m
    return disc, int(low[1]), int(low[0])
