"""Shaded pictures of triangle meshes by ray casting, for reports; no screen needed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from defras_bt.recording.palette import Rgb
from defras_bt.recording.shapes import vertex_normals
from defras_sim.geometry import Floats, Pose

_BACKGROUND = (255.0, 255.0, 255.0)
_TO_LIGHT = np.array([-0.35, -0.45, 0.82]) / np.linalg.norm([-0.35, -0.45, 0.82])
_AMBIENT, _SHADOWED = 0.46, 0.45
_SUPERSAMPLING = 2


@dataclass(frozen=True)
class Body:
    """A mesh of one colour. ``vertices_m`` (n, 3), ``triangles`` (m, 3)."""

    vertices_m: Floats
    triangles: NDArray[np.int64]
    colour: Rgb


@dataclass(frozen=True)
class View:
    """A pinhole camera: ``tissue_from_camera`` looks along +z, x right, y down."""

    tissue_from_camera: Pose
    vertical_fov_rad: float
    width_px: int
    height_px: int


def render(bodies: Sequence[Body], view: View) -> NDArray[np.uint8]:
    """Picture (height, width, 3) with diffuse light from the upper left and its shadows."""
    vertices_m = np.concatenate([body.vertices_m for body in bodies])
    starts = np.cumsum([0, *(len(body.vertices_m) for body in bodies)])
    faces = np.concatenate(
        [body.triangles + start for body, start in zip(bodies, starts[:-1], strict=True)]
    )
    colours = np.concatenate(
        [np.tile(np.array(body.colour, float), (len(body.triangles), 1)) for body in bodies]
    )
    normals = np.concatenate([vertex_normals(body.vertices_m, body.triangles) for body in bodies])
    scene = EmbreeScene()
    mesh = TriangleMesh(scene, vertices_m.astype(np.float32), faces.astype(np.int32))
    rows, columns = view.height_px * _SUPERSAMPLING, view.width_px * _SUPERSAMPLING
    origin_m, directions = _rays(view, rows, columns)
    found = scene.run(
        _single(np.tile(origin_m, (len(directions), 1))), _single(directions), output=1
    )
    ray = np.flatnonzero(found["primID"] >= 0)
    face, u, v = found["primID"][ray], found["u"][ray, None], found["v"][ray, None]
    hit_m = origin_m + directions[ray] * found["tfar"][ray, None]
    corners = normals[faces[face]]
    shading = (1 - u - v) * corners[:, 0] + u * corners[:, 1] + v * corners[:, 2]
    shading /= np.linalg.norm(shading, axis=1, keepdims=True)
    # Thin sheets are seen from both sides.
    towards = -np.einsum("rx,rx->r", shading, directions[ray])
    facing = np.where(towards[:, None] < 0, -shading, shading)
    light = np.clip(facing @ _TO_LIGHT, 0, 1)
    sunward = _single(np.tile(_TO_LIGHT, (len(hit_m), 1)))
    shadowed = scene.run(_single(hit_m + 2e-4 * facing), sunward, query="OCCLUDED") == 0
    del mesh  # the scene only borrows it
    light = np.where(shadowed, light * _SHADOWED, light)
    picture = np.tile(np.array(_BACKGROUND), (rows * columns, 1))
    picture[ray] = colours[face] * (_AMBIENT + (1.08 - _AMBIENT) * light)[:, None]
    shaped = picture.reshape(view.height_px, _SUPERSAMPLING, view.width_px, _SUPERSAMPLING, 3)
    return np.clip(shaped.mean(axis=(1, 3)), 0, 255).astype(np.uint8)


def _rays(view: View, rows: int, columns: int) -> tuple[Floats, Floats]:
    """Origin (3,) and unit directions (rows * columns, 3), row by row."""
    half = np.tan(view.vertical_fov_rad / 2)
    down = (np.arange(rows) + 0.5) / rows * 2 - 1
    right = ((np.arange(columns) + 0.5) / columns * 2 - 1) * view.width_px / view.height_px
    x, y = np.meshgrid(right * half, down * half)
    local = np.stack([x, y, np.ones_like(x)], axis=-1).reshape(-1, 3)
    world = local @ view.tissue_from_camera.rotation.T
    origin_m = view.tissue_from_camera.position_m
    return origin_m, world / np.linalg.norm(world, axis=1, keepdims=True)


def _single(values: Floats) -> NDArray[np.float32]:
    """Embree computes in single precision."""
    return np.ascontiguousarray(values, np.float32)
