"""Which part of the simulated surface counts as visible."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from defras_bt.monitoring.hidden import Optics, look, seen_places, touched_vertices
from defras_bt.monitoring.seen import SeenSurface, seen_surface
from defras_sim.camera.pinhole import in_picture, intrinsics, tissue_from_camera
from defras_sim.geometry import Floats
from defras_sim.scene import Camera, Scene
from defras_sim.surface import Surface
from tests.monitoring.shapes import Deform, folded, wavy

PLACES = np.array([[1 / 3, 1 / 3, 1 / 3], [0.7, 0.15, 0.15], [0.15, 0.7, 0.15], [0.15, 0.15, 0.7]])


def hits_before(eye_m: Floats, place_m: Floats, corners_m: Floats) -> NDArray[np.bool_]:
    """Which triangles (m, 3, 3), whichever way round, a ray meets before its place.

    Moeller and Trumbore, Fast, minimum storage ray-triangle intersection (1997).
    """
    ray = place_m - eye_m
    side, other = corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0]
    across, start = np.cross(ray, other), eye_m - corners_m[:, 0]
    determinant = np.einsum("md,md->m", side, across)
    u = np.einsum("md,md->m", start, across) / determinant
    turned = np.cross(start, side)
    v = turned @ ray / determinant
    share = np.einsum("md,md->m", turned, other) / determinant
    return (u >= 0) & (v >= 0) & (u + v <= 1) & (share > 0) & (share < 1 - 1e-5)


def ray_traced(surface: Surface, camera: Camera) -> SeenSurface:
    """The same by asking every triangle about the ray to every place."""
    corners = surface.vertices_m[surface.triangles]
    eye = np.array(camera.position_m)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing = np.flatnonzero(np.einsum("ij,ij->i", normal, eye - corners.mean(axis=1)) > 0.0)
    samples = np.einsum("sk,tkd->tsd", PLACES, corners[facing]).reshape(-1, 3)
    seen = np.array([not hits_before(eye, place, corners).any() for place in samples])
    seen &= in_picture(camera, samples)
    touched = np.zeros(len(surface.vertices_m), bool)
    touched[surface.triangles[facing[seen.reshape(-1, 4).any(axis=1)]]] = True
    chosen = facing[touched[surface.triangles[facing]].any(axis=1)]
    return SeenSurface(chosen, corners[chosen], lambda: samples[seen])


def placed(stretch: float, shift_m: tuple[float, float, float]) -> Deform:
    """As large and as near as asked."""
    return lambda points: points * stretch + shift_m


@pytest.mark.parametrize(
    "deform",
    [
        placed(1.0, (0.0, 0.0, 0.0)),
        placed(3.0, (0.0, 0.0, 0.0)),
        placed(1.0, (0.17, 0.0, 0.19)),
        placed(1.0, (0.1, 0.0, 0.12)),
        folded(),
        folded(0.004),
        *(wavy(seed) for seed in range(6)),
        *(wavy(seed, 0.04) for seed in range(4)),
    ],
)
def test_what_is_seen_is_what_rays_reach(
    deform: Deform, slab: Callable[..., Surface], scene: Scene
) -> None:
    surface = slab(deform, cells=12)
    found = seen_surface(surface, scene.depth_camera)
    expected = ray_traced(surface, scene.depth_camera)
    np.testing.assert_array_equal(found.triangles, expected.triangles)
    np.testing.assert_array_equal(found.corners_m, expected.corners_m)
    np.testing.assert_allclose(found.samples_m, expected.samples_m, atol=1e-15)


@pytest.mark.parametrize("deform", [folded(), placed(1.0, (0.17, 0.0, 0.19)), wavy(3, 0.04)])
def test_vertices_are_touched_where_any_place_beside_them_is_seen(
    deform: Deform, slab: Callable[..., Surface], scene: Scene
) -> None:
    surface, camera = slab(deform), scene.depth_camera
    pose, size_px = tissue_from_camera(camera), [camera.width_px, camera.height_px]
    turn = np.ascontiguousarray(pose.rotation)
    optics = Optics(pose.position_m, turn, intrinsics(camera), np.array(size_px, float))
    sight = look(surface.vertices_m, surface.triangles, optics)
    expected = np.zeros(len(surface.vertices_m), bool)
    expected[sight.triangles[seen_places(sight, PLACES, optics).any(axis=1)]] = True
    assert 0 < np.count_nonzero(expected) < len(expected)
    np.testing.assert_array_equal(touched_vertices(sight, PLACES, optics), expected)


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
    surface = slab(folded())
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
