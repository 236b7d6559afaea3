"""Surfaces that look like organs, made by formulas."""

from __future__ import annotations

import numpy as np
import trimesh


def lumpy_sheet(rings: int = 20, half_m: tuple[float, float] = (0.06, 0.05)) -> trimesh.Trimesh:
    """An oval, domed and lumpy sheet with one rim, facing up."""
    points, triangles = disc(rings)
    x, y = (points * half_m).T
    return trimesh.Trimesh(np.column_stack([x, y, lumps_m(x, y)]), triangles, process=False)


def lumps_m(x_m: np.ndarray, y_m: np.ndarray) -> np.ndarray:
    """Height of the lumpy sheet."""
    dome = 0.010 * np.cos(x_m / 0.05) * np.cos(y_m / 0.07)
    return dome + 0.0025 * np.sin(x_m / 0.013) * np.cos(y_m / 0.015)


def lumpy_body(subdivisions: int = 3) -> trimesh.Trimesh:
    """A closed body of about 100 x 80 x 30 mm, unlike from every side."""
    ball = trimesh.creation.icosphere(subdivisions=subdivisions)
    x, y, _ = ball.vertices.T
    scale = 1 + 0.06 * np.sin(5 * x) * np.cos(4 * y) + 0.05 * x
    vertices = ball.vertices * scale[:, None] * [0.05, 0.04, 0.015]
    return trimesh.Trimesh(vertices, ball.faces, process=False)


def disc(rings: int) -> tuple[np.ndarray, np.ndarray]:
    """The unit disc as rings of 6, 12, 18, ... points around its centre, and triangles."""
    radius = np.concatenate([[0.0], *(np.full(6 * k, k / rings) for k in range(1, rings + 1))])
    angle = np.concatenate(
        [[0.0], *(np.arange(6 * k) * 2 * np.pi / (6 * k) for k in range(1, rings + 1))]
    )
    points = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    triangles = []
    for k in range(1, rings + 1):
        inner, outer = 3 * (k - 1) * (k - 2) + 1, 3 * k * (k - 1) + 1
        for sector in range(6):
            for step in range(k):
                a = outer + sector * k + step
                b = outer + (sector * k + step + 1) % (6 * k)
                c = 0 if k == 1 else inner + (sector * (k - 1) + step) % (6 * (k - 1))
                triangles.append((a, b, c))
                if step < k - 1:
                    d = inner + (sector * (k - 1) + step + 1) % (6 * (k - 1))
                    triangles.append((b, d, c))
    return points, np.array(triangles)
