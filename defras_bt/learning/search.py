"""Search for the attachments that explain observed shapes.

Rounds of: linearise the tissue at every frame, flip blocks of holes as the linearised tissue
advises, solve the real model with the result, keep it if its true cost is lower.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from defras_bt.learning.cost import Cost, SearchSettings
from defras_bt.learning.linearised import Indices, LinearisedFrame
from defras_bt.learning.misfit import Misfit, misfit
from defras_bt.learning.observed_cells import ObservedCells
from defras_bt.learning.replay import NotRepeatable, Replay
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.surface import Surface

Mask = NDArray[np.bool_]

BLOCKS = ((1, 1), (1, 2), (2, 1), (2, 2), (1, 3), (3, 1), (2, 3), (3, 2), (3, 3))
"""Shapes of the blocks of holes that are made to hold, or to let go, at once. Single flips alone
get stuck: letting go one hole of a patch changes next to nothing while its neighbours hold."""


@dataclass(frozen=True)
class SearchResult:
    """``attached`` (holes,) is the best set found; ``probability`` (holes,) that each one holds,
    from what flipping it alone would cost. ``left_m``: root mean square of what it leaves of the
    fitted cells, large ones counted as the cost counts them."""

    attached: Mask
    probability: Floats
    cost_before: float
    cost_after: float
    left_m: float
    solves: int


class AttachmentSearch:
    """Searches around one belief with the points of ``frames`` that may be fitted."""

    def __init__(
        self,
        belief: Scene,
        replay: Replay,
        points_m: Sequence[Floats],
        frames: Sequence[int],
        settings: SearchSettings,
        considered: Mask | None = None,
    ) -> None:
        """``points_m`` are the fitted points (n, 3) of each of ``frames``. Only holes that are
        ``considered`` (holes,) may change, if given: time grows with their number."""
        self._belief = belief
        self._replay = replay
        self._cells = [ObservedCells.of(points) for points in points_m]
        self._frames = tuple(frames)
        self._settings = settings
        self._considered = belief.is_hole if considered is None else considered
        self._believed = belief.attached
        self._grid = np.arange(len(self._believed)).reshape(belief.hole_counts[::-1])
        self._cost = Cost(self._believed, self._grid.shape, settings)
        self._solves = 0
        self._place_of = np.full(len(self._believed), -1)
        """Where each hole lies in the linearised frames; -1: nothing can be told about it."""

    def run(self, start: Mask, rounds: int) -> SearchResult:
        """Search from ``start`` (holes,), whose shapes the replay holds.

        A set that the model cannot take is never chosen.

        Raises:
            NotRepeatable: the model finds no shape for ``start``, or the camera does not see it.
        """
        attached = start
        cost = before = self._true_cost(attached, keep=True)
        if not np.isfinite(cost):
            raise NotRepeatable("the model finds no visible shape to start the search from")
        linearised = self._linearise(attached)
        for _ in range(rounds):
            found = self._first_better(self._advise(attached, linearised), cost)
            if found is None:
                break
            attached, cost = found
            self._true_cost(attached, keep=True)
            linearised = self._linearise(attached)
        probability = self._probability(attached, linearised)
        return SearchResult(
            attached, probability, before, cost, self._left_m(attached, cost), self._solves
        )

    def _left_m(self, attached: Mask, cost: float) -> float:
        misfit = cost - float(self._cost.price(attached[None])[0])
        count = sum(cells.mean.shape[0] for cells in self._cells)
        return float(self._settings.error_m * np.sqrt(2.0 * max(misfit, 0.0) / max(count, 1)))

    def cost(self, attached: Mask) -> float:
        """What a set costs: misfit and price of departing from the belief."""
        return self._true_cost(attached, keep=False)

    def _first_better(self, advised: Sequence[Mask], cost: float) -> tuple[Mask, float] | None:
        """The longest of a descent's sets, each half of the one before, that truly is better."""
        while advised:
            value = self._true_cost(advised[-1], keep=False)
            if value < cost - 1e-6:
                return advised[-1], value
            advised = advised[: len(advised) // 2]
        return None

    def _advise(self, attached: Mask, frames: Sequence[LinearisedFrame]) -> list[Mask]:
        """Sets along a greedy descent of the linearised cost, each better than the one before."""
        here = attached
        cost = self._cost.of([frame.residual_m for frame in frames], here[None])[0]
        steps: list[Mask] = []
        observable = self._place_of >= 0
        for _ in range(self._settings.flips_per_round):
            blocks, sets = self._moves(here, observable)
            costs = np.concatenate(
                [
                    self._cost.of(
                        [
                            frame.predict(self._place_of[block], self._change(here, block, new))
                            for frame in frames
                        ],
                        new,
                    )
                    for block, new in zip(blocks, sets, strict=True)
                    if len(block)
                ]
                or [np.zeros(0)]
            )
            if len(costs) == 0 or costs.min() >= cost - 1e-3:
                break
            best = int(np.argmin(costs))
            cost = costs[best]
            new = np.concatenate(sets)[best]
            flipped = np.flatnonzero(new != here)
            change = self._change(here, flipped[None], new[None])[0]
            frames = [frame.changed(self._place_of[flipped], change) for frame in frames]
            here = new
            steps.append(here)
        return steps

    def _moves(self, here: Mask, observable: Mask) -> tuple[list[Indices], list[Mask]]:
        """Per block shape: useful blocks (b, q), and the sets (b, holes) that they lead to."""
        blocks, sets = [], []
        for height, width in BLOCKS:
            windows = np.lib.stride_tricks.sliding_window_view(self._grid, (height, width))
            each = windows.reshape(-1, height * width)
            each = each[observable[each].all(axis=1)]
            for holds in (True, False):
                # Blocks of which only one hole would change are covered by smaller shapes.
                useful = each[(here[each] != holds).sum(axis=1) > (height * width) // 2]
                new = np.repeat(here[None], len(useful), axis=0)
                np.put_along_axis(new, useful, holds, axis=1)
                blocks.append(useful)
                sets.append(new)
        return blocks, sets

    def _observable(self, attached: Mask) -> Mask:
        """Holes that a frame can tell anything about: free and away from rest, or under load."""
        s = self._settings
        free = self._belief.is_hole & ~attached & (self._stretch_m > s.observable_stretch_m)
        loaded = attached & (self._force_n > s.observable_force_share * self._force_n.max())
        shape = self._grid.shape
        near = np.zeros(shape, bool)
        for row, column in np.argwhere(loaded.reshape(shape)):
            near[max(0, row - 2) : row + 3, max(0, column - 2) : column + 3] = True
        return (free | (attached & near.ravel())) & self._considered

    def _change(self, here: Mask, blocks: Indices, sets: Mask) -> Floats:
        """Stiffness (b, q) that each hole of each block gains."""
        after = np.take_along_axis(sets, blocks, axis=1).astype(float)
        return self._belief.hold_n_per_m * (after - here[blocks])

    def _true_cost(self, attached: Mask, *, keep: bool) -> float:
        """Cost from the model itself; infinite where it finds no shape."""
        self._solves += len(self._frames)
        stiffness = self._belief.hole_stiffness_n_per_m(attached)
        states = self._replay.shapes(stiffness, self._frames, keep=keep)
        if states is None:
            return float("inf")
        compared = [
            misfit(cells.points_m, state.surface, self._belief.depth_camera)
            for cells, state in zip(self._cells, states, strict=True)
        ]
        known: list[Misfit] = [each for each in compared if each is not None]
        if len(known) < len(compared):
            return float("inf")
        if keep:
            self._misfits = known
            forces = [np.linalg.norm(state.attachment_forces_n, axis=1) for state in states]
            self._force_n = np.max(forces, axis=0)
            rest = self._replay.rest_surface
            moved = [_moved_m(state.surface, rest, self._belief) for state in states]
            self._stretch_m = np.max(moved, axis=0)
        residuals = [cells.residual_m(each) for cells, each in zip(self._cells, known, strict=True)]
        return float(self._cost.of(residuals, attached[None])[0])

    def _linearise(self, attached: Mask) -> list[LinearisedFrame]:
        """Every frame around its kept shape."""
        holes = np.flatnonzero(self._observable(attached))
        self._place_of[:] = -1
        self._place_of[holes] = np.arange(len(holes))
        stiffness = self._belief.hole_stiffness_n_per_m(attached)
        frames = []
        for frame, cells, compared in zip(self._frames, self._cells, self._misfits, strict=True):
            response = self._replay.response(frame, stiffness, holes)
            frames.append(
                LinearisedFrame(
                    cells.residual_m(compared),
                    cells.jacobian(compared, response),
                    response.holes_m_per_n,
                    response.stretch_m,
                )
            )
        return frames

    def _probability(self, attached: Mask, frames: Sequence[LinearisedFrame]) -> Floats:
        """Probability (holes,) of holding, from the cost of flipping each hole alone."""
        holes = np.arange(len(attached))
        sets = attached ^ np.eye(len(holes), dtype=bool)
        price = self._cost.price(sets) - self._cost.price(attached[None])
        seen = np.flatnonzero(self._place_of >= 0)[:, None]
        if len(seen):
            change = self._change(attached, seen, sets[seen[:, 0]])
            place = self._place_of[seen]
            flipped = [frame.predict(place, change) for frame in frames]
            now = self._cost.of([frame.residual_m for frame in frames], attached[None])
            price[seen[:, 0]] = self._cost.of(flipped, sets[seen[:, 0]]) - now
        wrong = 1.0 / (1.0 + np.exp(np.clip(price, 0.0, 50.0)))
        return np.where(self._belief.is_hole, np.where(attached, 1.0 - wrong, wrong), 0.0)


def _moved_m(surface: Surface, rest: Surface, scene: Scene) -> Floats:
    """How far (holes,) the lower face has moved from where it rests over each hole."""
    lower = np.flatnonzero(~surface.upper)
    nearest = cKDTree(surface.rest_xy_m[lower]).query(scene.holes_xy_m)[1]
    over = lower[nearest]
    moved_m = surface.vertices_m[over] - rest.vertices_m[over]
    return np.asarray(np.linalg.norm(moved_m, axis=1))
