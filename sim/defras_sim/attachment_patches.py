"""Connected patches of holding holes, as a suture leaves them: drawn, grown and shrunk.

Holes are masks (rows, columns), first row at the smallest y. Two holes belong to one patch if they
are neighbours along x or y.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve, label

Mask = NDArray[np.bool_]

_CROSS = np.array([[0, 1, 0], [1, 0, 1], [0, 1, 0]])
LAYOUTS = ("side", "two_sides", "corner", "u_shape", "islands", "line")


def patches(mask: Mask) -> list[Mask]:
    """One mask per connected patch."""
    numbered, count = label(mask)
    return [numbered == number for number in range(1, count + 1)]


def draw(layout: str, shape: tuple[int, int], rng: np.random.Generator) -> Mask:
    """A mask of ``shape`` in one of :data:`LAYOUTS`, turned and with ragged borders.

    Raises:
        ValueError: the layout is unknown.
    """
    if layout not in LAYOUTS:
        raise ValueError(f"unknown layout {layout!r}; valid: {', '.join(LAYOUTS)}")
    quarter_turns = int(rng.integers(4))
    side = max(shape)
    square = np.zeros((side, side), bool)
    _DRAWERS[layout](square, rng)
    mask = np.rot90(square, quarter_turns)[: shape[0], : shape[1]].copy()
    mask = grow(mask, int(rng.integers(1, 5)), rng)
    return shrink(mask, int(rng.integers(1, 4)), rng)


def grow(mask: Mask, count: int, rng: np.random.Generator) -> Mask:
    """Add ``count`` holes, each beside its patch; hollows fill before spikes grow."""
    grown = mask.copy()
    for _ in range(count):
        weight = np.where(grown, 0.0, _neighbours(grown).astype(float) ** 2)
        if not weight.any():
            break
        grown.flat[rng.choice(grown.size, p=weight.ravel() / weight.sum())] = True
    return grown


def shrink(mask: Mask, count: int, rng: np.random.Generator) -> Mask:
    """Take ``count`` holes away, each from a border, without cutting a patch in two."""
    shrunk = mask.copy()
    for _ in range(count):
        count_now = label(shrunk)[1]
        inner = _neighbours(shrunk).ravel() == 4
        borders = np.flatnonzero(shrunk.ravel() & ~inner)
        removable = [index for index in borders if not _cuts(shrunk, index, count_now)]
        if not removable:
            break
        weight = (5.0 - _neighbours(shrunk).ravel()[removable]) ** 2
        shrunk.flat[rng.choice(removable, p=weight / weight.sum())] = False
    return shrunk


def resized(mask: Mask, holes: int, rng: np.random.Generator) -> Mask:
    """About the same patches with ``holes`` holes in all: some are lost, shrunk, grown or new."""
    changed = mask.copy()
    # A whole patch is lost where that leaves enough, in half of the cases.
    for patch in sorted(patches(mask), key=np.sum):
        if changed.sum() - patch.sum() >= holes and rng.random() < 0.5:
            changed &= ~patch
    missing = holes - int(changed.sum())
    if missing < 0:
        return shrink(changed, -missing, rng)
    if missing >= 6 and rng.random() < 0.5:
        changed = _new_patch(changed, rng)
    return grow(changed, holes - int(changed.sum()), rng)


def _new_patch(mask: Mask, rng: np.random.Generator) -> Mask:
    """``mask`` with a patch of 2 x 2 holes more that touches no other, where there is room."""
    taken = mask | (_neighbours(mask) > 0)
    room = ~(taken[:-1, :-1] | taken[1:, :-1] | taken[:-1, 1:] | taken[1:, 1:])
    if not room.any():
        return mask
    row, column = np.argwhere(room)[rng.integers(room.sum())]
    changed = mask.copy()
    changed[row : row + 2, column : column + 2] = True
    return changed


def _neighbours(mask: Mask) -> NDArray[np.int64]:
    return convolve(mask.astype(np.int64), _CROSS, mode="constant")


def _cuts(mask: Mask, index: np.intp, patch_count: int) -> bool:
    """Whether taking hole ``index`` away splits its patch, or leaves no hole at all."""
    without = mask.copy()
    without.flat[index] = False
    return bool(label(without)[1] > patch_count) or not without.any()


def _strip(square: Mask, rng: np.random.Generator) -> None:
    """Two or three columns at the smallest x, over a good part of the side."""
    side = len(square)
    length = int(rng.integers(side // 2, side + 1))
    start = int(rng.integers(0, side - length + 1))
    square[start : start + length, : int(rng.integers(1, 4))] = True


def _draw_two_sides(square: Mask, rng: np.random.Generator) -> None:
    _strip(square, rng)
    _strip(square[:, ::-1] if rng.random() < 0.5 else square.T, rng)


def _draw_corner(square: Mask, rng: np.random.Generator) -> None:
    length = int(rng.integers(5, 9))
    square[:length, :2] = True
    square[:2, :length] = True


def _draw_u_shape(square: Mask, rng: np.random.Generator) -> None:
    length = int(rng.integers(4, 9))
    square[:, : int(rng.integers(1, 3))] = True
    square[: int(rng.integers(1, 3)), :length] = True
    square[-int(rng.integers(1, 3)) :, :length] = True


def _draw_islands(square: Mask, rng: np.random.Generator) -> None:
    side = len(square)
    for _ in range(int(rng.integers(2, 5))):
        height, width = rng.integers(2, 5, size=2)
        row, column = rng.integers(0, side - height + 1), rng.integers(0, side - width + 1)
        square[row : row + height, column : column + width] = True


def _draw_line(square: Mask, rng: np.random.Generator) -> None:
    """A suture across the tissue, two holes wide, that steps aside now and then."""
    side = len(square)
    column = int(rng.integers(2, side - 3))
    length = int(rng.integers(side // 2, side + 1))
    for row in range(length):
        square[row, column : column + 2] = True
        column = int(np.clip(column + rng.choice([-1, 0, 0, 0, 1]), 0, side - 2))


_DRAWERS = {
    "side": _strip,
    "two_sides": _draw_two_sides,
    "corner": _draw_corner,
    "u_shape": _draw_u_shape,
    "islands": _draw_islands,
    "line": _draw_line,
}
