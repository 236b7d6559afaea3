"""The corotational material where two of its principal stretches nearly add up to zero.

With signed principal stretches s1 >= s2 >= |s3| its energy is mu (|F|^2 - 2 T + 3) + lambda/2
(T - 3)^2 with T = s1 + s2 + s3. Where s2 + s3 = 0 the rotation R jumps, and T has an edge like |x|:
strongly stretched tissue comes to lie right in it, and no method that follows gradients ends there.
So T = s1 + f(s2 + s3), where f rounds the edge off: f(x) = x from ``WIDTH`` on, and below it the
even polynomial of degree four that continues it with two derivatives. Tissue that is not inside out
never gets there.

Derivatives by the singular values' frames: Smith, de Goes and Kim, ACM TOG 38 (2019) 20.
"""

from __future__ import annotations

import math

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.tissue.matrices import cofactor, jit, singular_frames

WIDTH = 0.1


@jit
def is_near(F: Floats) -> bool:
    """True wherever s2 + s3 < WIDTH: then s2 s3 <= WIDTH^2 / 4. May be true elsewhere."""
    size = 0.0
    for i in range(3):
        for j in range(3):
            size += F[i, j] * F[i, j]
    return cofactor(F, np.empty((3, 3))) <= 0.25 * WIDTH * WIDTH * math.sqrt(size)


@jit
def _rounded(x: float) -> tuple[float, float, float]:
    """f(x) and its first two derivatives."""
    if x >= WIDTH:
        return x, 1.0, 0.0
    y = x / WIDTH
    value = WIDTH * (0.375 + 0.75 * y**2 - 0.125 * y**4)
    return value, 1.5 * y - 0.5 * y**3, (1.5 - 1.5 * y**2) / WIDTH


@jit
def stress(F: Floats, mu: float, lam: float, P: Floats) -> float:
    """Write the first Piola stress to ``P``; return the energy density."""
    U, V, sigma = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    singular_frames(F, U, V, sigma)
    value, slope, _ = _rounded(sigma[1] + sigma[2])
    excess = sigma[0] + value - 3
    size = sigma[0] ** 2 + sigma[1] ** 2 + sigma[2] ** 2
    factor = lam * excess - 2 * mu
    for i in range(3):
        for j in range(3):
            rotated = U[i, 0] * V[j, 0] + slope * (U[i, 1] * V[j, 1] + U[i, 2] * V[j, 2])
            P[i, j] = 2 * mu * F[i, j] + factor * rotated
    return mu * (size - 2 * (excess + 3) + 3) + 0.5 * lam * excess * excess


@jit
def tangent(F: Floats, mu: float, lam: float, A: Floats) -> None:
    """Write dP/dF to ``A`` (9, 9).

    2 mu I + lambda G (x) G + (lambda (T - 3) - 2 mu) dG/dF with G = dT/dF.
    """
    U, V, sigma = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    singular_frames(F, U, V, sigma)
    value, slope, bend = _rounded(sigma[1] + sigma[2])
    factor = lam * (sigma[0] + value - 3) - 2 * mu
    slopes = np.array([1.0, slope, slope])
    A[:] = 0.0
    for p in range(9):
        A[p, p] = 2 * mu
    mode = np.empty(9)
    _frame_matrix(U, V, slopes, mode)
    _add_outer(mode, lam, A)
    _frame_matrix(U, V, np.array([0.0, 1.0, 1.0]), mode)
    _add_outer(mode, factor * bend, A)
    for i in range(3):
        j = (i + 1) % 3
        total = sigma[i] + sigma[j]
        apart = sigma[i] - sigma[j]
        # Turning one frame against the other, and both against each other: 0/0 where i, j = 1, 2.
        if i == 1:
            twist = 2 * slope / total if total > 1e-9 else 3.0 / WIDTH
        else:
            twist = (slopes[i] + slopes[j]) / max(total, 1e-9)
        flip = (slopes[i] - slopes[j]) / apart if abs(apart) > 1e-9 else 0.0
        for sign, share in ((-1.0, twist), (1.0, flip)):
            for k in range(3):
                for m in range(3):
                    mode[3 * k + m] = (U[k, i] * V[m, j] + sign * U[k, j] * V[m, i]) * math.sqrt(
                        0.5
                    )
            _add_outer(mode, factor * share, A)


@jit
def _frame_matrix(U: Floats, V: Floats, diagonal: Floats, mode: Floats) -> None:
    for i in range(3):
        for j in range(3):
            mode[3 * i + j] = 0.0
            for k in range(3):
                mode[3 * i + j] += diagonal[k] * U[i, k] * V[j, k]


@jit
def _add_outer(mode: Floats, scale: float, A: Floats) -> None:
    for p in range(9):
        for q in range(9):
            A[p, q] += scale * mode[p] * mode[q]
