"""Which part of the simulated surface counts as visible."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from defras_bt.monitoring.seen import seen_surface
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.surface import Surface


def test_the_lower_face_of_a_resting_slab_is_never_seen(
    slab: Callable[..., Surface], scene: Scene
) -> None:
    surface = slab()
    seen = seen_surface(surface, scene.depth_camera)
    upper = surface.upper[surface.triangles].all(axis=1)
    lower = (~surface.upper)[surface.triangles].all(axis=1)
    assert set(np.flatnonzero(upper)) <= set(seen.triangles)
    assert not lower[seen.triangles].any()
    assert seen.samples_m[:, 0].max() > 0.0599  # the side facing the camera


def test_tissue_under_a_flap_is_hidden_and_the_flaps_lower_face_is_seen(
    slab: Callable[..., Surface], scene: Scene
) -> None:
    def fold(points: Floats) -> Floats:
        """Bend the half x < 0 up and over towards the camera, around a 10 mm arc."""
        radius = 0.01
        angle = np.clip(-points[:, 0] / radius, 0.0, np.pi)
        straight = np.maximum(-points[:, 0] - np.pi * radius, 0.0)
        inner = radius - points[:, 2]
        bent = np.column_stack(
            [-inner * np.sin(angle) + straight, points[:, 1], radius - inner * np.cos(angle)]
        )
        return np.where(points[:, :1] < 0.0, bent, points)

    surface = slab(fold)
    seen = seen_surface(surface, scene.depth_camera)
    on_lower = (~surface.upper)[surface.triangles[seen.triangles]].all(axis=1)
    lower_center = seen.corners_m[on_lower].mean(axis=1)
    assert len(lower_center) > 20
    assert (lower_center[:, 2] > 0.005).all()
    under_flap = (
        (seen.samples_m[:, 0] > 0.0) & (seen.samples_m[:, 0] < 0.01) & (seen.samples_m[:, 2] < 0.01)
    )
    assert not under_flap.any()


def test_a_surface_out_of_the_picture_is_not_seen(
    slab: Callable[..., Surface], scene: Scene
) -> None:
    seen = seen_surface(slab(lambda points: points + [0, 1.0, 0]), scene.depth_camera)
    assert len(seen.triangles) == 0
    assert len(seen.samples_m) == 0
