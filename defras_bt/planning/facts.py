"""What the ASP programs are told about a scene and a situation."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
from clingo import Function, Number, Symbol, Tuple_
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from defras_bt.planning.plan import MANOEUVRES, GridPoint, Situation
from defras_sim.advice import Matter
from defras_sim.scene import Scene

_SIDES = {"+y": "plus", "-y": "minus"}


def roi_distances_mm(scene: Scene) -> dict[GridPoint, int]:
    """From each grasp point to the centre of the region of interest, in the tissue plane."""
    center = scene.roi_center_m[:2]
    return {
        point: round(1000 * float(np.linalg.norm(scene.grasp_xy_m(*point) - center)))
        for point in scene.grasp_points
    }


def attachment_distances_mm(scene: Scene, attached: NDArray[np.bool_]) -> dict[GridPoint, int]:
    """From each grasp point to the nearest hole believed to hold; empty if none is.

    ``attached`` (holes,) in the order of ``scene.holes_xy_m``.
    """
    holes_xy_m = scene.holes_xy_m
    if np.shape(attached) != (len(holes_xy_m),):
        raise ValueError(
            f"attached has shape {np.shape(attached)}; this scene has {len(holes_xy_m)} holes"
        )
    held_xy_m = holes_xy_m[np.asarray(attached, dtype=bool)]
    if not len(held_xy_m):
        return {}
    points_xy_m = np.array([scene.grasp_xy_m(*point) for point in scene.grasp_points])
    nearest_m = cKDTree(held_xy_m).query(points_xy_m)[0]
    return dict(
        zip(scene.grasp_points, np.rint(1000 * nearest_m).astype(int).tolist(), strict=True)
    )


def scene_facts(scene: Scene) -> str:
    """Facts that never change: arms, grasp points, distances to the region, the expert's rules."""
    lines = [
        f"arm({name},{_SIDES[arm.side]},{rank})."
        for rank, (name, arm) in enumerate(sorted(scene.arms.items()), start=1)
    ]
    to_roi = roi_distances_mm(scene)
    for rank, point in enumerate(scene.grasp_points):
        x_mm, y_mm = (_mm_outwards(value) for value in scene.grasp_xy_m(*point))
        place = _text(point)
        lines.append(f"grasp_point({place},{x_mm},{y_mm}).")
        lines.append(f"distance_to_roi({place},{to_roi[point]}).")
        lines.append(f"point_rank({place},{rank}).")
    for number, advice in enumerate(scene.advice):
        lines.append(advice_fact(number, advice.kind, advice.matter))
    return "\n".join(lines)


def advice_fact(number: int, kind: str, about: Matter) -> str:
    """One rule: an expert's, or what a question demands."""
    place = "any" if about.point is None else _text(about.point)
    return f"advice({number},{kind},{about.action or 'any'},{about.arm or 'any'},{place})."


def advised(number: int) -> Symbol:
    """The external atom that puts a rule in force."""
    return Function("advised", [Number(number)])


def belief_facts(distances_mm: dict[GridPoint, int]) -> str:
    """Distances to the attachments believed in; the program fills in the belief's number k."""
    return "\n".join(
        f"distance_to_attachment({_text(point)},{distance},k)."
        for point, distance in distances_mm.items()
    )


def world_atoms(
    situation: Situation, exposing: Sequence[str], required: GridPoint | None
) -> set[Symbol]:
    """The external atoms that are true now. An arm that holds a point is at it."""
    atoms = {Function("blocked", [point_symbol(point)]) for point in situation.blocked}
    atoms |= {Function("exposing", [Function(name)]) for name in exposing}
    if required is not None:
        atoms.add(Function("required", [point_symbol(required)]))
    for name, arm in situation.arms.items():
        tool = Function(name)
        place = arm.at if arm.holding is None else arm.holding
        if place is not None:
            atoms.add(_sensed("at", tool, point_symbol(place)))
        if arm.holding is not None:
            atoms.add(_sensed("holding", tool, point_symbol(arm.holding)))
            atoms |= {_sensed("done", tool, Function(done)) for done in arm.done}
        if arm.jaw_open:
            atoms.add(_sensed("jaw_open", tool))
    return atoms


def require_valid(
    scene: Scene, situation: Situation, exposing: Sequence[str], required: GridPoint | None
) -> None:
    """Raise ValueError, naming what would be valid, if the question does not fit the scene."""
    if set(situation.arms) != set(scene.arms):
        raise ValueError(
            f"the situation describes arms {sorted(situation.arms)}; the scene has "
            f"{sorted(scene.arms)}"
        )
    if not exposing:
        raise ValueError(f"no manoeuvre would expose the region; name some of {MANOEUVRES}")
    for name in [*exposing, *(done for arm in situation.arms.values() for done in arm.done)]:
        if name not in MANOEUVRES:
            raise ValueError(f"unknown manoeuvre {name!r}; valid: {', '.join(MANOEUVRES)}")
    places: list[GridPoint | None] = [required, *situation.blocked]
    places += [place for arm in situation.arms.values() for place in (arm.at, arm.holding)]
    _require_on_grid(scene, (place for place in places if place is not None))


def _require_on_grid(scene: Scene, points: Iterable[GridPoint]) -> None:
    valid = scene.grasp_points
    for column, row in points:
        if (column, row) not in valid:
            first, last = (f"({c},{r})" for c, r in (valid[0], valid[-1]))
            raise ValueError(f"({column},{row}) is no grasp point; valid are {first} to {last}")


def point_symbol(point: GridPoint) -> Symbol:
    return Tuple_([Number(point[0]), Number(point[1])])


def _sensed(name: str, *arguments: Symbol) -> Symbol:
    return Function("sensed", [Function(name, list(arguments))])


def _text(point: GridPoint) -> str:
    return f"({point[0]},{point[1]})"


def _mm_outwards(value_m: float) -> int:
    """Millimetres, rounded away from 0: only a point on the plane itself gets 0."""
    return int(math.copysign(math.ceil(abs(value_m) * 1000 - 1e-6), value_m))
