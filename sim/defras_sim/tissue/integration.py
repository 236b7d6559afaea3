"""Compiled loops of what is known at quadrature points: gradients in, nodal forces and blocks out.

``gradients`` (elements, points, 3, nodes of an element) are rest gradients of shape functions,
``volumes`` (elements, points) rest volumes. The base material has loops of its own, which keep
everything of a point in registers (:mod:`defras_sim.tissue.kernels`).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Floats
from defras_sim.tissue import blocks
from defras_sim.tissue.matrices import cofactor, jacobi_eigen, jit
from defras_sim.tissue.mesh import Integers


@jit
def deformations(positions: Floats, connectivity: Integers, gradients: Floats, out: Floats) -> None:
    """Write the deformation gradient F of every point to ``out`` (elements, points, 3, 3)."""
    elements, points, _, width = gradients.shape
    for e in range(elements):
        for q in range(points):
            slopes = gradients[e, q]
            F = out[e, q]
            F[:] = 0.0
            for a in range(width):
                node = connectivity[e, a]
                for i in range(3):
                    for j in range(3):
                        F[i, j] += positions[node, i] * slopes[j, a]


@jit
def add_nodal_forces(
    stresses: Floats, connectivity: Integers, gradients: Floats, volumes: Floats, out: Floats
) -> None:
    """Integrate first Piola stresses (elements, points, 3, 3); add the gradient to ``out``."""
    elements, points, _, width = gradients.shape
    for e in range(elements):
        for q in range(points):
            slopes, P, volume = gradients[e, q], stresses[e, q], volumes[e, q]
            for a in range(width):
                node = connectivity[e, a]
                for i in range(3):
                    total = 0.0
                    for j in range(3):
                        total += P[i, j] * slopes[j, a]
                    out[node, i] += volume * total


@jit
def add_stiffness(
    tangents: Floats,
    gradients: Floats,
    volumes: Floats,
    places: NDArray[np.int32],
    entries: Floats,
) -> None:
    """Integrate symmetric dP/dF (elements, points, 9, 9); add the blocks to matrix ``entries``.

    ``places`` (elements, a, b, 3): entry of row 3 a in column 3 b + k, before the next two rows.
    """
    elements, points, _, width = gradients.shape
    block = np.empty((3, 3, width, width))
    for e in range(elements):
        block[:] = 0.0
        for q in range(points):
            blocks.add_point(block, gradients[e, q], tangents[e, q], volumes[e, q])
        blocks.add_to_matrix(block, places[e], entries)


@jit
def largest_principal_stress(F: Floats, P: Floats) -> tuple[float, int, int]:
    """Largest principal Cauchy stress of F and P (elements, points, 3, 3), and where it acts."""
    sigma = np.empty((3, 3))
    V = np.empty((3, 3))
    largest, at_element, at_point = -np.inf, 0, 0
    for e in range(F.shape[0]):
        for q in range(F.shape[1]):
            f, p = F[e, q], P[e, q]
            J = cofactor(f, sigma)
            for i in range(3):
                for j in range(3):
                    sigma[i, j] = (p[i, 0] * f[j, 0] + p[i, 1] * f[j, 1] + p[i, 2] * f[j, 2]) / J
            if not _largest_at_most(sigma) > largest:
                continue
            jacobi_eigen(sigma, V)
            value = max(sigma[0, 0], sigma[1, 1], sigma[2, 2])
            if value > largest:
                largest, at_element, at_point = value, e, q
    return largest, at_element, at_point


@jit
def _largest_at_most(sigma: Floats) -> float:
    """A bound on the largest eigenvalue of a symmetric matrix: mean, and twice the deviator's rms.

    Exact where two eigenvalues below the largest are equal; it spares most points the rest.
    """
    mean = (sigma[0, 0] + sigma[1, 1] + sigma[2, 2]) / 3
    square = 0.0
    for i in range(3):
        for j in range(3):
            deviation = sigma[i, j] - mean if i == j else sigma[i, j]
            square += deviation * deviation
    return mean + 2 * math.sqrt(square / 6)
