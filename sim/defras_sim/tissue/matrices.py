"""3x3 matrices in compiled loops: cofactor, polar rotation, eigenvalues."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from defras_sim.geometry import Floats

# Sums may be reordered; NaN and infinity keep their meaning, because the solver looks for them.
jit = njit(cache=True, nogil=True, fastmath={"contract", "reassoc", "nsz"}, error_model="numpy")


@jit
def cofactor(F: Floats, out: Floats) -> float:
    """Write the cofactor matrix J F^-T of ``F`` to ``out``; return J."""
    out[0, 0] = F[1, 1] * F[2, 2] - F[1, 2] * F[2, 1]
    out[0, 1] = F[1, 2] * F[2, 0] - F[1, 0] * F[2, 2]
    out[0, 2] = F[1, 0] * F[2, 1] - F[1, 1] * F[2, 0]
    out[1, 0] = F[2, 1] * F[0, 2] - F[2, 2] * F[0, 1]
    out[1, 1] = F[2, 2] * F[0, 0] - F[2, 0] * F[0, 2]
    out[1, 2] = F[2, 0] * F[0, 1] - F[2, 1] * F[0, 0]
    out[2, 0] = F[0, 1] * F[1, 2] - F[0, 2] * F[1, 1]
    out[2, 1] = F[0, 2] * F[1, 0] - F[0, 0] * F[1, 2]
    out[2, 2] = F[0, 0] * F[1, 1] - F[0, 1] * F[1, 0]
    return F[0, 0] * out[0, 0] + F[0, 1] * out[0, 1] + F[0, 2] * out[0, 2]


@jit
def singular_frames(F: Floats, U: Floats, V: Floats, sigma: Floats) -> None:
    """Write F = U diag(sigma) V^T, both frames right-handed, sigma[0] >= sigma[1] >= |sigma[2]|.

    The last singular value has the sign of det F.
    """
    C = np.empty((3, 3))
    W = np.eye(3)
    for i in range(3):
        for j in range(3):
            C[i, j] = F[0, i] * F[0, j] + F[1, i] * F[1, j] + F[2, i] * F[2, j]
    jacobi_eigen(C, W)
    largest = smallest = 0
    for i in range(1, 3):
        if C[i, i] > C[largest, largest]:
            largest = i
        if C[i, i] <= C[smallest, smallest]:
            smallest = i
    if largest == smallest:
        largest, smallest = 0, 2
    for i in range(3):
        V[i, 0], V[i, 1] = W[i, largest], W[i, 3 - largest - smallest]
    _complete(V)
    for column in range(2):
        for i in range(3):
            U[i, column] = F[i, 0] * V[0, column] + F[i, 1] * V[1, column] + F[i, 2] * V[2, column]
    _orthonormal(U)
    _complete(U)
    for k in range(3):
        sigma[k] = 0.0
        for i in range(3):
            for j in range(3):
                sigma[k] += U[i, k] * F[i, j] * V[j, k]


@jit
def _orthonormal(U: Floats) -> None:
    """Make the first two columns orthonormal; where one vanishes, any direction will do."""
    for column in range(2):
        for attempt in range(4):
            if column == 1:
                along = U[0, 0] * U[0, 1] + U[1, 0] * U[1, 1] + U[2, 0] * U[2, 1]
                for i in range(3):
                    U[i, 1] -= along * U[i, 0]
            norm = math.sqrt(U[0, column] ** 2 + U[1, column] ** 2 + U[2, column] ** 2)
            if norm > 1e-14:
                for i in range(3):
                    U[i, column] /= norm
                break
            for i in range(3):
                U[i, column] = 1.0 if i == attempt else 0.0


@jit
def _complete(U: Floats) -> None:
    """Write the cross product of the first two columns to the third."""
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        U[i, 2] = U[j, 0] * U[k, 1] - U[k, 0] * U[j, 1]


@jit
def _rotation_by_singular_vectors(F: Floats, R: Floats) -> None:
    U, V, sigma = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    singular_frames(F, U, V, sigma)
    for i in range(3):
        for j in range(3):
            R[i, j] = U[i, 0] * V[j, 0] + U[i, 1] * V[j, 1] + U[i, 2] * V[j, 2]


@jit
def rotation(F: Floats, R: Floats) -> None:
    """Write the rotation of F = R S to ``R``: a proper one even if F is inverted.

    Newton's iteration for the polar factor, X <- (g X + X^-T / g) / 2, doubles the digits each time
    (Higham, SIAM J. Sci. Stat. Comput. 7 (1986), 1160-1174). Where F nearly has no volume, or is
    inverted, the iteration has no proper limit: singular vectors decide.
    """
    other = np.empty((3, 3))
    J = cofactor(F, other)
    size = 0.0
    for i in range(3):
        for j in range(3):
            R[i, j] = F[i, j]
            size += F[i, j] * F[i, j]
    if not (J / (size * math.sqrt(size)) > 1e-3):
        _rotation_by_singular_vectors(F, R)
        return
    for _ in range(20):
        inverse = 0.0
        for i in range(3):
            for j in range(3):
                inverse += other[i, j] * other[i, j]
        scale = math.sqrt(math.sqrt(inverse / size) / J)
        size = change = 0.0
        for i in range(3):
            for j in range(3):
                x = 0.5 * (scale * R[i, j] + other[i, j] / (scale * J))
                change += (x - R[i, j]) ** 2
                size += x * x
                R[i, j] = x
        # The change squares in each step: what is left is below rounding.
        if change < 1e-18:
            return
        J = cofactor(R, other)


@jit
def jacobi_eigen(C: Floats, V: Floats) -> None:
    """Diagonalise symmetric ``C`` (3, 3) in place by Jacobi rotations, gathered in ``V``."""
    for _ in range(12):
        off = abs(C[0, 1]) + abs(C[0, 2]) + abs(C[1, 2])
        if not off > 1e-15 * (abs(C[0, 0]) + abs(C[1, 1]) + abs(C[2, 2])):
            return
        for p in range(2):
            for q in range(p + 1, 3):
                if C[p, q] == 0.0:
                    continue
                theta = (C[q, q] - C[p, p]) / (2 * C[p, q])
                t = (1.0 if theta >= 0 else -1.0) / (abs(theta) + math.sqrt(theta * theta + 1))
                c = 1 / math.sqrt(t * t + 1)
                s = t * c
                for k in range(3):
                    x, y = C[k, p], C[k, q]
                    C[k, p], C[k, q] = c * x - s * y, s * x + c * y
                for k in range(3):
                    x, y = C[p, k], C[q, k]
                    C[p, k], C[q, k] = c * x - s * y, s * x + c * y
                for k in range(3):
                    x, y = V[k, p], V[k, q]
                    V[k, p], V[k, q] = c * x - s * y, s * x + c * y
