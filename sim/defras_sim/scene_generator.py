"""Seeded scenes: what is believed, and what is really there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from defras_sim.attachment_patches import LAYOUTS, Mask, draw, patches, resized
from defras_sim.camera.ray_caster import RayCaster
from defras_sim.camera.visibility import roi_visibility
from defras_sim.exposure import find_exposing
from defras_sim.retraction import Rehearsal
from defras_sim.scene import Attachments, Roi, Scene
from defras_sim.tissue.model import TissueModel

Relation = Literal["fewer", "more", "equal"]

SHARE: dict[Relation, tuple[float, float]] = {
    "fewer": (0.2, 0.6),
    "more": (1.4, 1.6),
    "equal": (1.0, 1.0),
}
"""Holding holes of the actual scene as a share of those believed."""

_MOST_BELIEFS = 60
_MOST_ACTUALS = 6
_HOLES = (10, 48)


class NoScene(RuntimeError):
    """No draw of the generator could be exposed."""


@dataclass(frozen=True)
class Solved:
    """A scene whose region is hidden at rest, and a retraction that exposes it."""

    scene: Scene
    solution: Rehearsal


@dataclass(frozen=True)
class GeneratedScene:
    """What is believed and what is there; somebody who knew could expose the region of either."""

    believed: Solved
    actual: Solved


Solver = Callable[[Scene], Solved | None]


def generate_scene(
    seed: int,
    relation: Relation = "fewer",
    *,
    layout: str | None = None,
    tell: Callable[[str], None] = lambda sentence: None,
    solver: Solver | None = None,
) -> GeneratedScene:
    """The first draw of ``seed`` that can be exposed as believed and as it really is.

    ``tell`` hears what became of each draw: each costs some seconds of rehearsing. ``solver`` is
    :func:`solve`, or remembers what that said.

    Raises:
        NoScene: no draw can be; another seed or layout may do.
    """
    solver, rng = solver or solve, np.random.default_rng(seed)
    for number in range(1, _MOST_BELIEFS + 1):
        drawn = draw_believed(rng, name=f"seed{seed}", layout=layout)
        said = f"draw {number}: {drawn.description.removeprefix('Believed: ').removesuffix('.')}"
        believed = solver(drawn)
        if believed is None:
            tell(f"{said}: cannot be exposed")
            continue
        tell(f"{said}: can be exposed; looking for what is really there")
        actual = solved_actual(believed, relation, rng, solver)
        if actual is not None:
            return GeneratedScene(believed, actual)
        tell(f"{said}: nothing with {relation} attachments can be exposed")
    raise NoScene(f"seed {seed}: none of {_MOST_BELIEFS} draws can be exposed; try another seed")


def solved_actual(
    believed: Solved, relation: Relation, rng: np.random.Generator, solver: Solver | None = None
) -> Solved | None:
    """An actual scene for ``believed`` that can be exposed; None where six draws gave none."""
    for _ in range(_MOST_ACTUALS):
        drawn = draw_actual(believed.scene, relation, rng)
        if relation == "equal":
            return Solved(drawn, believed.solution)
        actual = (solver or solve)(drawn)
        if actual is not None:
            return actual
    return None


def solve(scene: Scene) -> Solved | None:
    """Find out whether the region is hidden at rest and can be exposed."""
    rest = TissueModel(scene).solve({})
    if _buried(scene) or roi_visibility(scene, RayCaster(rest.surface)) > 0.0:
        return None
    solution = find_exposing(scene)
    return None if solution is None else Solved(scene, solution)


def draw_believed(rng: np.random.Generator, *, name: str, layout: str | None = None) -> Scene:
    """A scene with patches in ``layout`` (any, if None) and a region away from all of them."""
    layout = str(rng.choice(LAYOUTS)) if layout is None else layout
    frame = Scene(
        name=name, attachments=Attachments(map=("#",)), roi=Roi(center_x_m=0, center_y_m=0)
    )
    nx, ny = frame.hole_counts
    mask = draw(layout, (ny, nx), rng)
    while not _HOLES[0] <= mask.sum() <= _HOLES[1]:
        mask = draw(layout, (ny, nx), rng)
    limit_m = np.array([frame.tissue.length_x_m, frame.tissue.width_y_m]) / 2 - frame.roi.radius_m
    x_m, y_m = np.round(rng.uniform(-limit_m, limit_m), 3)
    return frame.with_attached(mask.ravel()).model_copy(
        update={
            "description": f"Believed: {_counted(mask)}, layout {layout.replace('_', ' ')}.",
            "roi": Roi(center_x_m=float(x_m), center_y_m=float(y_m)),
        }
    )


def draw_actual(believed: Scene, relation: Relation, rng: np.random.Generator) -> Scene:
    """``believed`` with another number of holding holes, in the range of ``relation``."""
    nx, ny = believed.hole_counts
    mask = believed.attached.reshape(ny, nx)
    low, high = SHARE[relation]
    count = int(mask.sum())
    fewest, most = int(np.ceil(low * count - 1e-9)), int(np.floor(high * count + 1e-9))
    actual = (
        mask if relation == "equal" else resized(mask, int(rng.integers(fewest, most + 1)), rng)
    )
    return believed.with_attached(actual.ravel()).model_copy(
        update={
            "name": f"{believed.name}_{relation}",
            "description": f"Actual: {_counted(actual)}, {relation} than believed."
            if relation != "equal"
            else f"Actual: {_counted(actual)}, as believed.",
        }
    )


def _buried(scene: Scene) -> bool:
    """Whether tissue is held right above the region, so that nothing can show it."""
    held_m = scene.holes_xy_m[scene.attached]
    away_m = np.linalg.norm(held_m - scene.roi_center_m[:2], axis=1)
    return bool(np.mean(away_m < scene.roi.radius_m - scene.attachments.hole_radius_m) > 0)


def _counted(mask: Mask) -> str:
    count = len(patches(mask))
    return f"{int(mask.sum())} holes in {count} patch{'es' if count > 1 else ''}"
