"""Where the nodes of a behaviour tree stand in a drawing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

Place = tuple[float, float]


def parent_of(path: str) -> str | None:
    """``defras/operate`` for ``defras/operate/act``; None for the root."""
    return path.rpartition("/")[0] or None


def tree_order(paths: Sequence[str]) -> list[str]:
    """Parents before children, siblings in the order given, children of one node together."""
    position = {path: index for index, path in enumerate(paths)}

    def rank(path: str) -> tuple[int, ...]:
        parts = path.split("/")
        return tuple(position.get("/".join(parts[: i + 1]), -1) for i in range(len(parts)))

    return sorted(paths, key=rank)


def tree_layout(
    paths: Sequence[str], row_px: float = 90.0, column_px: float = 46.0
) -> dict[str, Place]:
    """Places (x, y) of nodes: leaves one below the other, parents left of the middle of theirs.

    ``paths`` lists parents before children; a path whose parent is missing stands as a root.
    """
    children: dict[str | None, list[str]] = {}
    known = set(paths)
    for path in paths:
        parent = parent_of(path)
        children.setdefault(parent if parent in known else None, []).append(path)
    places: dict[str, Place] = {}
    next_leaf = [0.0]
    for root in children.get(None, []):
        _place(root, 0, children, places, next_leaf, (row_px, column_px))
    return places


def _place(
    path: str,
    depth: int,
    children: Mapping[str | None, list[str]],
    places: dict[str, Place],
    next_leaf: list[float],
    spacing: tuple[float, float],
) -> None:
    below = children.get(path, [])
    for child in below:
        _place(child, depth + 1, children, places, next_leaf, spacing)
    if below:
        y = (places[below[0]][1] + places[below[-1]][1]) / 2
    else:
        y = next_leaf[0]
        next_leaf[0] += spacing[1]
    places[path] = (depth * spacing[0] * 2, y)
