"""Hyperelastic materials at one point: energy density, first Piola stress P, tangent dP/dF.

``F`` (3, 3) is the deformation gradient. Energies vanish at rest and are infinite where the
material does not exist (neo-Hookean at J <= 0). The tangent is ``A[3 i + J, 3 k + L]``.

- corotational: mu |F - R|^2 + lambda/2 (tr(R^T F) - 3)^2, F = R S.
  Stomakhin et al., Energetically consistent invertible elasticity, SCA 2012 (unmodified form).
  Stretched to more than twice its length it turns inside out across, as no tissue does, and its
  energy has an edge where two principal stretches add up to zero; see
  :mod:`defras_sim.tissue.collapsed`.
- neo_hookean: mu/2 (tr C - 3) - mu ln J + lambda/2 (ln J)^2. Bonet and Wood, 2nd ed., eq. 6.28.
- stable_neo_hookean: mu/2 (I_C - 3) + lambda/2 (J - alpha)^2 - mu/2 ln(I_C + 1),
  alpha = 1 + 3/4 mu/lambda. Smith, de Goes, Kim, ACM TOG 37 (2018) 12, and PyBullet.
"""

from __future__ import annotations

import math

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.scene import MaterialName
from defras_sim.tissue import collapsed
from defras_sim.tissue.matrices import cofactor, jit, rotation

CODES: dict[MaterialName, int] = {"corotational": 0, "neo_hookean": 1, "stable_neo_hookean": 2}


def lame_parameters(
    material: MaterialName, young_modulus_pa: float, poisson_ratio: float
) -> tuple[float, float]:
    """(mu, lambda) [Pa] that the material's formula takes, for small-strain E and nu.

    For ``stable_neo_hookean`` these are the numbers to hand to PyBullet (NeoHookeanMu,
    NeoHookeanLambda): linearised at rest its stress is 3/2 mu e + (lambda - 5/8 mu) tr e, so the
    formula's mu and lambda are not the Lame parameters of linear elasticity.
    """
    mu = young_modulus_pa / (2 * (1 + poisson_ratio))
    lam = young_modulus_pa * poisson_ratio / ((1 + poisson_ratio) * (1 - 2 * poisson_ratio))
    if material == "stable_neo_hookean":
        return 4 / 3 * mu, lam + 5 / 6 * mu
    return mu, lam


def lame_by_poisson(material: MaterialName, mu: Floats, lam: Floats) -> tuple[Floats, Floats]:
    """Derivatives of what :func:`lame_parameters` gives by Poisson's ratio at fixed E [Pa]."""
    mu, lam = _linear(material, mu, lam)
    nu = lam / (2 * (lam + mu))
    young = 2 * mu * (1 + nu)
    mu_by = -young / (2 * (1 + nu) ** 2)
    lam_by = young * (1 + 2 * nu**2) / ((1 + nu) * (1 - 2 * nu)) ** 2
    if material == "stable_neo_hookean":
        return 4 / 3 * mu_by, lam_by + 5 / 6 * mu_by
    return mu_by, lam_by


def shear_modulus_pa(material: MaterialName, mu: Floats) -> Floats:
    """Small-strain shear modulus, for the mu that the material's formula takes."""
    return 3 / 4 * mu if material == "stable_neo_hookean" else mu


def young_modulus_pa(material: MaterialName, mu: Floats, lam: Floats) -> Floats:
    """Small-strain Young's modulus: what :func:`lame_parameters` was given."""
    mu, lam = _linear(material, mu, lam)
    return mu * (3 * lam + 2 * mu) / (lam + mu)


def _linear(material: MaterialName, mu: Floats, lam: Floats) -> tuple[Floats, Floats]:
    """Lame parameters of linear elasticity."""
    shear = shear_modulus_pa(material, mu)
    return shear, lam - 5 / 6 * shear if material == "stable_neo_hookean" else lam


@jit
def stress(code: int, F: Floats, mu: float, lam: float, P: Floats) -> float:
    """Write the first Piola stress to ``P`` (3, 3); return the energy density [J/m^3]."""
    if code == 0:
        if collapsed.is_near(F):
            return collapsed.stress(F, mu, lam, P)
        R = np.empty((3, 3))
        rotation(F, R)
        excess = -3.0
        distance = 0.0
        for i in range(3):
            for j in range(3):
                excess += R[i, j] * F[i, j]
                distance += (F[i, j] - R[i, j]) ** 2
        for i in range(3):
            for j in range(3):
                P[i, j] = 2 * mu * (F[i, j] - R[i, j]) + lam * excess * R[i, j]
        return mu * distance + 0.5 * lam * excess * excess
    J = cofactor(F, P)
    trace = 0.0
    for i in range(3):
        for j in range(3):
            trace += F[i, j] * F[i, j]
    if code == 1:
        if not J > 0.0:
            return np.inf
        log_j = math.log(J)
        pull = (lam * log_j - mu) / J
        for i in range(3):
            for j in range(3):
                P[i, j] = mu * F[i, j] + pull * P[i, j]
        return 0.5 * mu * (trace - 3) - mu * log_j + 0.5 * lam * log_j * log_j
    alpha = 1 + 0.75 * mu / lam
    shear = mu * (1 - 1 / (trace + 1))
    for i in range(3):
        for j in range(3):
            P[i, j] = shear * F[i, j] + lam * (J - alpha) * P[i, j]
    # Differences to the rest state, so that a large constant does not drown small energies.
    volume = 0.5 * lam * (J - 1) * (J - 1) - 0.75 * mu * (J - 1)
    return 0.5 * mu * (trace - 3) + volume - 0.5 * mu * math.log((trace + 1) / 4)


@jit
def tangent(code: int, F: Floats, mu: float, lam: float, A: Floats) -> None:
    """Write dP/dF to ``A`` (9, 9)."""
    B = np.empty((3, 3))
    if code == 0:
        if collapsed.is_near(F):
            collapsed.tangent(F, mu, lam, A)
        else:
            _corotational_tangent(F, mu, lam, A, B)
        return
    J = cofactor(F, B)
    trace = 0.0
    for i in range(3):
        for j in range(3):
            trace += F[i, j] * F[i, j]
    if code == 1:
        outer, crossed, straight, along = lam / J**2, (mu - lam * math.log(J)) / J**2, mu, 0.0
    else:
        alpha = 1 + 0.75 * mu / lam
        # d cof F / dF = (cof (x) cof - crossed) / J; J never divides because the terms combine.
        outer, crossed, straight = lam, 0.0, mu * (1 - 1 / (trace + 1))
        along = 2 * mu / (trace + 1) ** 2
    for i in range(3):
        for j in range(3):
            for k in range(3):
                for m in range(3):
                    value = outer * B[i, j] * B[k, m] + crossed * B[i, m] * B[k, j]
                    if code == 2:
                        value += along * F[i, j] * F[k, m]
                    A[3 * i + j, 3 * k + m] = value
        for j in range(3):
            A[3 * i + j, 3 * i + j] += straight
    if code == 2:
        _add_cofactor_derivative(F, lam * (J - alpha), A)


@jit
def _add_cofactor_derivative(F: Floats, scale: float, A: Floats) -> None:
    """Add ``scale`` d(cof F)/dF, written with permutation symbols so that J may be zero."""
    for i in range(3):
        k, n = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            m, p = (j + 1) % 3, (j + 2) % 3
            # cof F[i, j] = F[k, m] F[n, p] - F[k, p] F[n, m]
            A[3 * i + j, 3 * k + m] += scale * F[n, p]
            A[3 * i + j, 3 * n + p] += scale * F[k, m]
            A[3 * i + j, 3 * k + p] -= scale * F[n, m]
            A[3 * i + j, 3 * n + m] -= scale * F[k, p]


@jit
def _corotational_tangent(F: Floats, mu: float, lam: float, A: Floats, R: Floats) -> None:
    """2 mu I + lambda R (x) R + (lambda tr(S - I) - 2 mu) dR/dF.

    dR[dF] = R [w] with (tr(S) I - S) w = axial(R^T dF - dF^T R).
    """
    rotation(F, R)
    S = np.empty((3, 3))
    trace = 0.0
    for i in range(3):
        for j in range(3):
            S[i, j] = R[0, i] * F[0, j] + R[1, i] * F[1, j] + R[2, i] * F[2, j]
        trace += S[i, i]
    G = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            G[i, j] = -0.5 * (S[i, j] + S[j, i])
        G[i, i] += trace
    H = np.empty((3, 3))
    determinant = cofactor(G, H)
    factor = lam * (trace - 3) - 2 * mu
    # W[3 i + j, a]: R [e_a] component, the rotation's change for a unit axial vector e_a.
    W = np.empty((9, 3))
    for i in range(3):
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            # [e_a] has (c, b) = 1 and (b, c) = -1
            W[3 * i + a, a] = 0.0
            W[3 * i + b, a] = R[i, c]
            W[3 * i + c, a] = -R[i, b]
    for p in range(9):
        for q in range(9):
            turn = 0.0
            for a in range(3):
                for b in range(3):
                    # H is symmetric: cofactor of a symmetric matrix.
                    turn += W[p, a] * H[a, b] * W[q, b]
            A[p, q] = lam * R[p // 3, p % 3] * R[q // 3, q % 3] + factor * turn / determinant
        A[p, p] += 2 * mu
