"""Dense arithmetic of a multifrontal Cholesky factorisation, compiled.

A front is the part of the matrix that the elimination of one separator touches: rows of the
separator itself (``panel``, p x n) and of its border, the nodes eliminated later that it meets
(``update``, m x m, n = p + m). Upper triangles, row by row. Duff and Reid, ACM TOMS 9 (1983),
302-325. Compiled loops reach half the speed of a tuned BLAS here, but never start threads of their
own, which on a busy machine costs more than it gains for matrices of this size.
"""

from __future__ import annotations

import math

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.tissue.matrices import jit
from defras_sim.tissue.mesh import Integers

# Rows eliminated before the rest of the front hears of them: they stay in the fastest cache.
_ROWS_AT_ONCE = 24
# Columns worked on at once, four rows together.
_TILE = 512


@jit
def eliminate(
    first: int,
    last: int,
    sizes: Integers,
    borders: Integers,
    panel_starts: Integers,
    update_starts: Integers,
    children: Integers,
    border_starts: Integers,
    local: Integers,
    entry_starts: Integers,
    entry_places: Integers,
    entry_sources: Integers,
    entries: Floats,
    shift: float,
    panels: Floats,
    updates: Floats,
) -> bool:
    """Factorise the fronts ``first`` .. ``last`` - 1; False where the matrix is not positive.

    See :class:`defras_sim.tissue.elimination.Plan` for the arrays.
    """
    tile = np.zeros(4 * _TILE)
    for s in range(first, last):
        p, m = sizes[s], borders[s]
        n = p + m
        flat = panels[panel_starts[s] : panel_starts[s] + p * n]
        flat[:] = 0.0
        for k in range(entry_starts[s], entry_starts[s + 1]):
            panels[entry_places[k]] = entries[entry_sources[k]]
        panel = flat.reshape(p, n)
        for k in range(p):
            panel[k, k] += shift
        update = updates[update_starts[s] : update_starts[s] + m * m].reshape(m, m)
        for i in range(m):
            for j in range(i, m):
                update[i, j] = 0.0
        for c in children[s]:
            if c >= 0:
                size = borders[c]
                below = updates[update_starts[c] : update_starts[c] + size * size]
                where = local[border_starts[c] : border_starts[c] + size // 3]
                _add(below.reshape(size, size), where, panel, update)
        if not _eliminate_panel(panel, update, tile):
            return False
    return True


@jit
def _add(below: Floats, where: Integers, panel: Floats, update: Floats) -> None:
    """Add a child's ``update`` where its nodes stand in the parent's front."""
    p = panel.shape[0]
    for k in range(len(where)):
        for a in range(3):
            row = 3 * where[k] + a
            source = below[3 * k + a]
            target = panel[row] if row < p else update[row - p]
            shift = 0 if row < p else p
            for b in range(a, 3):
                target[3 * where[k] + b - shift] += source[3 * k + b]
            for j in range(k + 1, len(where)):
                column = 3 * where[j] - shift
                target[column] += source[3 * j]
                target[column + 1] += source[3 * j + 1]
                target[column + 2] += source[3 * j + 2]


@jit
def _eliminate_panel(panel: Floats, update: Floats, tile: Floats) -> bool:
    p, n = panel.shape
    for start in range(0, p, _ROWS_AT_ONCE):
        end = min(start + _ROWS_AT_ONCE, p)
        for group in range(start, end, 4):
            after = min(group + 4, end)
            _subtract(panel, start, group, panel, group, after, 0, tile)
            for k in range(group, after):
                row = panel[k, k:]
                for i in range(group, k):
                    above = panel[i, k:]
                    factor = above[0]
                    for j in range(n - k):
                        row[j] -= factor * above[j]
                if not row[0] > 0.0:
                    return False
                scale = 1.0 / math.sqrt(row[0])
                for j in range(n - k):
                    row[j] *= scale
        _subtract(panel, start, end, panel, end, p, 0, tile)
        _subtract(panel, start, end, update, 0, n - p, p, tile)
    return True


@jit
def _subtract(
    panel: Floats,
    start: int,
    end: int,
    target: Floats,
    first: int,
    last: int,
    offset: int,
    tile: Floats,
) -> None:
    """target[i, j] -= sum over start <= k < end of panel[k, offset + i] panel[k, offset + j].

    For first <= i < last and at least for j >= i.
    """
    if start == end:
        return
    columns = target.shape[1]
    for row in range(first, last, 4):
        rows = min(4, last - row)
        for left in range(row, columns, _TILE):
            width = min(_TILE, columns - left)
            for r in range(rows):
                source = target[row + r, left : left + width]
                for i in range(width):
                    tile[r * _TILE + i] = source[i]
            _subtract_from_tile(panel, start, end, offset + row, offset + left, width, tile)
            for r in range(rows):
                source = target[row + r, left : left + width]
                for i in range(width):
                    source[i] = tile[r * _TILE + i]


@jit
def _subtract_from_tile(
    panel: Floats, start: int, end: int, row: int, left: int, width: int, tile: Floats
) -> None:
    """tile[r, i] -= sum over k of panel[k, row + r] panel[k, left + i], for four r.

    The tile's rows lie at a fixed distance: the compiler then proves that the loop may be
    vectorised, and sixteen factors stay in registers.
    """
    most = panel.shape[1] - 1
    c0, c1, c2, c3 = row, min(row + 1, most), min(row + 2, most), min(row + 3, most)
    k = start
    while k + 4 <= end:
        r0, r1, r2, r3 = panel[k], panel[k + 1], panel[k + 2], panel[k + 3]
        a0, a1, a2, a3 = r0[c0], r1[c0], r2[c0], r3[c0]
        b0, b1, b2, b3 = r0[c1], r1[c1], r2[c1], r3[c1]
        d0, d1, d2, d3 = r0[c2], r1[c2], r2[c2], r3[c2]
        e0, e1, e2, e3 = r0[c3], r1[c3], r2[c3], r3[c3]
        s0, s1, s2, s3 = r0[left:], r1[left:], r2[left:], r3[left:]
        for i in range(width):
            x0, x1, x2, x3 = s0[i], s1[i], s2[i], s3[i]
            tile[i] -= a0 * x0 + a1 * x1 + a2 * x2 + a3 * x3
            tile[_TILE + i] -= b0 * x0 + b1 * x1 + b2 * x2 + b3 * x3
            tile[2 * _TILE + i] -= d0 * x0 + d1 * x1 + d2 * x2 + d3 * x3
            tile[3 * _TILE + i] -= e0 * x0 + e1 * x1 + e2 * x2 + e3 * x3
        k += 4
    while k < end:
        r0 = panel[k]
        a0, b0, d0, e0 = r0[c0], r0[c1], r0[c2], r0[c3]
        s0 = r0[left:]
        for i in range(width):
            x0 = s0[i]
            tile[i] -= a0 * x0
            tile[_TILE + i] -= b0 * x0
            tile[2 * _TILE + i] -= d0 * x0
            tile[3 * _TILE + i] -= e0 * x0
        k += 1


@jit
def solve_vector(
    sizes: Integers,
    borders: Integers,
    panel_starts: Integers,
    first_unknowns: Integers,
    border_starts: Integers,
    border_nodes: Integers,
    panels: Floats,
    x: Floats,
) -> None:
    """Solve in place for ``x`` (unknowns,) in the order of elimination."""
    work = np.empty(sizes.max() + borders.max())
    for s in range(len(sizes)):
        p, m = sizes[s], borders[s]
        panel = panels[panel_starts[s] : panel_starts[s] + p * (p + m)].reshape(p, p + m)
        first, border = first_unknowns[s], border_starts[s]
        own, rest = work[:p], work[p : p + m]
        own[:] = x[first : first + p]
        rest[:] = 0.0
        _forward(panel, own, rest)
        x[first : first + p] = own
        for i in range(m // 3):
            node = 3 * border_nodes[border + i]
            for a in range(3):
                x[node + a] += rest[3 * i + a]
    for s in range(len(sizes) - 1, -1, -1):
        p, m = sizes[s], borders[s]
        panel = panels[panel_starts[s] : panel_starts[s] + p * (p + m)].reshape(p, p + m)
        first, border = first_unknowns[s], border_starts[s]
        own, rest = work[:p], work[p : p + m]
        own[:] = x[first : first + p]
        for i in range(m // 3):
            node = 3 * border_nodes[border + i]
            for a in range(3):
                rest[3 * i + a] = x[node + a]
        _backward(panel, own, rest)
        x[first : first + p] = own


@jit
def _forward(panel: Floats, own: Floats, rest: Floats) -> None:
    """own <- U_pp^-T own; rest -= U_pm^T own. Sizes of fronts are multiples of three."""
    p = len(own)
    for k in range(0, p, 3):
        r0, r1, r2 = panel[k], panel[k + 1], panel[k + 2]
        v0 = own[k] / r0[k]
        v1 = (own[k + 1] - v0 * r0[k + 1]) / r1[k + 1]
        v2 = (own[k + 2] - v0 * r0[k + 2] - v1 * r1[k + 2]) / r2[k + 2]
        own[k], own[k + 1], own[k + 2] = v0, v1, v2
        for i in range(k + 3, p):
            own[i] -= v0 * r0[i] + v1 * r1[i] + v2 * r2[i]
        s0, s1, s2 = r0[p:], r1[p:], r2[p:]
        for i in range(len(rest)):
            rest[i] -= v0 * s0[i] + v1 * s1[i] + v2 * s2[i]


@jit
def _backward(panel: Floats, own: Floats, rest: Floats) -> None:
    """own <- U_pp^-1 (own - U_pm rest)."""
    p = len(own)
    for k in range(p - 3, -1, -3):
        r0, r1, r2 = panel[k], panel[k + 1], panel[k + 2]
        t0 = t1 = t2 = 0.0
        for i in range(k + 3, p):
            t0 += r0[i] * own[i]
            t1 += r1[i] * own[i]
            t2 += r2[i] * own[i]
        s0, s1, s2 = r0[p:], r1[p:], r2[p:]
        for i in range(len(rest)):
            t0 += s0[i] * rest[i]
            t1 += s1[i] * rest[i]
            t2 += s2[i] * rest[i]
        v2 = (own[k + 2] - t2) / r2[k + 2]
        v1 = (own[k + 1] - t1 - r1[k + 2] * v2) / r1[k + 1]
        v0 = (own[k] - t0 - r0[k + 1] * v1 - r0[k + 2] * v2) / r0[k]
        own[k], own[k + 1], own[k + 2] = v0, v1, v2


@jit
def solve_matrix(
    sizes: Integers,
    borders: Integers,
    panel_starts: Integers,
    first_unknowns: Integers,
    border_starts: Integers,
    border_nodes: Integers,
    panels: Floats,
    x: Floats,
) -> None:
    """Solve in place for all columns of ``x`` (unknowns, k) at once."""
    width = x.shape[1]
    work = np.empty((sizes.max() + borders.max(), width))
    for s in range(len(sizes)):
        p, m = sizes[s], borders[s]
        n = p + m
        panel = panels[panel_starts[s] : panel_starts[s] + p * n].reshape(p, n)
        first, border = first_unknowns[s], border_starts[s]
        work[:p] = x[first : first + p]
        work[p:n] = 0.0
        for k in range(p):
            row, value = panel[k], work[k]
            for c in range(width):
                value[c] /= row[k]
            for i in range(k + 1, n):
                target, factor = work[i], row[i]
                for c in range(width):
                    target[c] -= factor * value[c]
        x[first : first + p] = work[:p]
        for i in range(m // 3):
            node = 3 * border_nodes[border + i]
            x[node : node + 3] += work[p + 3 * i : p + 3 * i + 3]
    for s in range(len(sizes) - 1, -1, -1):
        p, m = sizes[s], borders[s]
        n = p + m
        panel = panels[panel_starts[s] : panel_starts[s] + p * n].reshape(p, n)
        first, border = first_unknowns[s], border_starts[s]
        for i in range(m // 3):
            node = 3 * border_nodes[border + i]
            work[p + 3 * i : p + 3 * i + 3] = x[node : node + 3]
        for k in range(p - 1, -1, -1):
            row, value = panel[k], work[k]
            value[:] = x[first + k]
            for i in range(k + 1, n):
                source, factor = work[i], row[i]
                for c in range(width):
                    value[c] -= factor * source[c]
            for c in range(width):
                value[c] /= row[k]
        x[first : first + p] = work[:p]
