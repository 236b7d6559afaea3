"""Loops over elements and quadrature points, compiled: the base material.

``gradients`` (elements, points, 3, nodes of an element) are rest gradients of shape functions,
``volumes`` (elements, points) rest volumes, ``mu`` and ``lam`` (elements, points) the material's
own.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Floats
from defras_sim.tissue import blocks, materials
from defras_sim.tissue.matrices import jit
from defras_sim.tissue.mesh import Integers


@jit
def _deformation(gradient: Floats, local: Floats, F: Floats) -> None:
    """F[i, J] = sum over nodes of local[i, a] gradient[J, a]."""
    for i in range(3):
        for j in range(3):
            total = 0.0
            for a in range(local.shape[1]):
                total += local[i, a] * gradient[j, a]
            F[i, j] = total


@jit
def energy_and_gradient(
    code: int,
    positions: Floats,
    connectivity: Integers,
    gradients: Floats,
    volumes: Floats,
    mu: Floats,
    lam: Floats,
    out: Floats,
) -> float:
    """Add the gradient to ``out`` (nodes, 3); return the energy."""
    elements, points, _, width = gradients.shape
    local = np.empty((3, width))
    force = np.empty((3, width))
    F = np.empty((3, 3))
    P = np.empty((3, 3))
    energy = 0.0
    for e in range(elements):
        for a in range(width):
            for i in range(3):
                local[i, a] = positions[connectivity[e, a], i]
                force[i, a] = 0.0
        for q in range(points):
            slopes = gradients[e, q]
            volume = volumes[e, q]
            _deformation(slopes, local, F)
            energy += volume * materials.stress(code, F, mu[e, q], lam[e, q], P)
            for i in range(3):
                x, y, z = volume * P[i, 0], volume * P[i, 1], volume * P[i, 2]
                for a in range(width):
                    force[i, a] += x * slopes[0, a] + y * slopes[1, a] + z * slopes[2, a]
        for a in range(width):
            for i in range(3):
                out[connectivity[e, a], i] += force[i, a]
    return energy


@jit
def tangent(
    code: int,
    positions: Floats,
    connectivity: Integers,
    gradients: Floats,
    volumes: Floats,
    mu: Floats,
    lam: Floats,
    places: NDArray[np.int32],
    out: Floats,
) -> None:
    """Add the second derivative to the matrix entries ``out``.

    ``places`` (elements, a, b, 3): entry of row 3 a in column 3 b + k, before the next two rows.
    """
    elements, points, _, width = gradients.shape
    local = np.empty((3, width))
    block = np.empty((3, 3, width, width))
    F = np.empty((3, 3))
    A = np.empty((9, 9))
    for e in range(elements):
        for a in range(width):
            for i in range(3):
                local[i, a] = positions[connectivity[e, a], i]
        block[:] = 0.0
        for q in range(points):
            slopes = gradients[e, q]
            _deformation(slopes, local, F)
            materials.tangent(code, F, mu[e, q], lam[e, q], A)
            blocks.add_point(block, slopes, A, volumes[e, q])
        blocks.add_to_matrix(block, places[e], out)


@jit
def stresses(code: int, F: Floats, mu: Floats, lam: Floats, density: Floats, out: Floats) -> None:
    """Write ``density`` (elements, points) [J/m^3], and the first Piola stress of every F
    (elements, points, 3, 3) to ``out``."""
    for e in range(F.shape[0]):
        for q in range(F.shape[1]):
            density[e, q] = materials.stress(code, F[e, q], mu[e, q], lam[e, q], out[e, q])


@jit
def tangents(code: int, F: Floats, mu: Floats, lam: Floats, out: Floats) -> None:
    """Write dP/dF of every F (elements, points, 3, 3) to ``out`` (elements, points, 9, 9)."""
    for e in range(F.shape[0]):
        for q in range(F.shape[1]):
            materials.tangent(code, F[e, q], mu[e, q], lam[e, q], out[e, q])
