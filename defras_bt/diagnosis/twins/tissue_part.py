"""What a cause would change in one trajectory, near one model, layer by layer.

Everything is (rows, frames): predictions with the cause less predictions without it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from defras_bt.diagnosis.twins.tissue_cells import AssignedCloud
from defras_bt.diagnosis.twins.tissue_frames import TissueFrames
from defras_bt.diagnosis.twins.tissue_keyframes import Keyframes, keyframes
from defras_bt.diagnosis.twins.tissue_pass import KeyShape, Place
from defras_bt.diagnosis.twins.tissue_paths import Carried, HeldPath, Paths
from defras_bt.diagnosis.twins.tissue_responses import FrameResponse
from defras_bt.diagnosis.twins.tissue_signals import Layout, cloud_residual_m
from defras_bt.diagnosis.twins.tissue_trajectory import Trajectory
from defras_sim.effects.camera_layer import CameraLayer
from defras_sim.effects.effect import Extension, Values
from defras_sim.effects.layers import Layers
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.surface import Surface

ASIDE_M = 0.002
"""How far beside its place tissue is taken to see what that changes."""


@dataclass(frozen=True)
class KeyShapes:
    """Solved keyframes of the model: as it is, and with every jaw taking (and keeping) the tissue
    :data:`ASIDE_M` farther along x, and along y. None where it could not follow; empty where nobody
    asks for it."""

    plain: Sequence[KeyShape | None] = ()
    aside_x: Sequence[KeyShape | None] = ()
    aside_y: Sequence[KeyShape | None] = ()


class TissuePart:
    """One trajectory beside ``model`` (all effects, adopted ones included)."""

    def __init__(
        self,
        scene: Scene,
        model: Extension,
        layout: Layout,
        trajectory: Trajectory,
        assigned: Sequence[AssignedCloud],
        frames: TissueFrames,
    ) -> None:
        self._scene, self._model, self._layout = scene, model, layout
        self._trajectory, self._assigned, self._frames = trajectory, assigned, frames
        self.keyframes: Keyframes = keyframes(trajectory)
        self._paths = Paths(scene, trajectory)
        self._by_grips: dict[str, Floats] = {}

    @property
    def trajectory(self) -> Trajectory:
        return self._trajectory

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and frames."""
        return self._layout.rows, len(self._trajectory.frames)

    @cached_property
    def residual(self) -> Floats:
        """Measured minus predicted (rows, frames)."""
        camera = self._scene.depth_camera
        return self._layout.residual(self._trajectory, self._assigned, self._frames, camera)

    @cached_property
    def _points_m(self) -> list[Floats]:
        """Points of every frame where the model holds that they truly are."""
        return [self._frames.corrected(cloud.points_m) for cloud in self._assigned]

    @cached_property
    def _responses(self) -> list[FrameResponse]:
        camera = self._scene.depth_camera
        vertices = max(
            (len(s.vertices_m) for s in self._frames.surfaces if s is not None), default=0
        )
        return [
            FrameResponse(
                self._layout,
                cloud,
                None if surface is None else cloud.compared(points, surface, camera),
                vertices,
            )
            for cloud, points, surface in zip(
                self._assigned, self._points_m, self._frames.surfaces, strict=True
            )
        ]

    def camera(self, with_effect: Extension) -> Floats:
        """With effects of the camera as in ``with_effect``."""
        layer = CameraLayer(self._scene.depth_camera, Layers.of(with_effect).camera)
        columns = [
            response.to_points((layer.corrected(cloud.points_m) - points)[:, :, None])
            for response, cloud, points in zip(
                self._responses, self._assigned, self._points_m, strict=True
            )
        ]
        return np.concatenate(columns, axis=1)

    def late(self, delay_s: float) -> Floats:
        """With clouds older by ``delay_s``; tips and forces keep their time."""
        time_s = self._trajectory.time_s
        shifted = tuple(self._surface_at(t - delay_s) for t in time_s)
        camera, cells = self._scene.depth_camera, len(self._layout.grid)
        found = np.zeros((self._layout.rows, len(time_s)))
        now = cloud_residual_m(self._assigned, self._frames, camera, cells)
        then = replace(self._frames, surfaces=shifted)
        found[:cells] = now - cloud_residual_m(self._assigned, then, camera, cells)
        return found

    def carried(self, with_effect: Extension, shapes: KeyShapes) -> Floats:
        """With effects of arm and grasp as in ``with_effect``."""
        layers, plain = Layers.of(with_effect), Layers.of(self._model)
        found = np.zeros((self._layout.rows, len(self._trajectory.frames)))
        for row, arm in enumerate(self._layout.with_tip):
            first = self._layout.first_tip_row + 3 * row
            tips = self._paths.measured_m(layers, arm) - self._frames.tips_m[arm]
            found[first : first + 3] = tips.T
        forces = self._frames.forces_n
        before, after = self._paths.held(plain, forces), self._paths.held(layers, forces)
        for one, other in zip(before, after, strict=True):
            found += self._with_grip(one, Carried.between(one, other), shapes)
        return found

    def differentiated(self, shapes: KeyShapes, effect: str) -> dict[Place, Floats]:
        """Change per unit of each parameter of ``effect`` that has a derivative."""
        places: list[Place] = []
        for shape in shapes.plain:
            if shape is not None:
                places += [p for p in shape.places if p[0] == effect and p not in places]
        if not places:
            return {}
        columns = np.full((self._layout.rows, len(self.keyframes.chosen), len(places)), np.nan)
        for index, (frame, shape) in enumerate(
            zip(self.keyframes.chosen, shapes.plain, strict=True)
        ):
            if shape is None:
                continue
            at = np.array([shape.places.index(p) if p in shape.places else -1 for p in places])
            missing = at < 0
            surface = shape.effects_by[:, :, at] * ~missing
            forces = {arm: by[:, at] * ~missing for arm, by in shape.force_by_effects.items()}
            columns[:, index] = self._responses[frame].to_surface(surface, forces)
        spread = self.keyframes.expanded(columns)
        return {place: spread[:, :, i] for i, place in enumerate(places)}

    def repeated(
        self, shapes: Sequence[KeyShape | None], others: Sequence[KeyShape | None]
    ) -> Floats:
        """With another model, which was led along the keyframes as well."""
        columns = np.full((self._layout.rows, len(self.keyframes.chosen), 1), np.nan)
        camera, cells = self._scene.depth_camera, len(self._layout.grid)
        for index, (frame, one, other) in enumerate(
            zip(self.keyframes.chosen, shapes, others, strict=True)
        ):
            surface = self._frames.surfaces[frame]
            if one is None or other is None or surface is None:
                continue
            change = other.vertices_m - one.vertices_m
            moved = replace(surface, vertices_m=surface.vertices_m + change)
            both = [
                self._assigned[frame].residual_m(self._points_m[frame], each, camera)
                for each in (surface, moved)
            ]
            forces = {arm: (f - one.forces_n[arm])[:, None] for arm, f in other.forces_n.items()}
            column = self._responses[frame].to_surface(change[:, :, None], forces)
            column[:cells, 0] = both[0] - both[1]
            columns[:, index] = column
        return self.keyframes.expanded(columns)[:, :, 0]

    def _with_grip(self, grip: HeldPath, carried: Carried, shapes: KeyShapes) -> Floats:
        """What a grip taken and carried elsewhere changes (rows, frames).

        What a jaw does is known for every frame, also where it changes at once, as by a slip. What
        that does to the tissue changes slowly, and is known at the keyframes. How high above the
        tissue a jaw closes makes no difference: the patch keeps its place in it.
        """
        if grip.arm not in self._by_grips:
            self._by_grips[grip.arm] = self._by_grip(grip.arm, shapes)
        elsewhere = np.zeros((len(self._trajectory.frames), 8))
        elsewhere[grip.frames, :3] = carried.farther_m
        elsewhere[grip.frames, 3:6] = carried.turned_rad
        elsewhere[grip.frames, 6:] = carried.beside_m[:2] / ASIDE_M
        return np.einsum("rfk,fk->rf", self._by_grips[grip.arm], elsewhere)

    def _by_grip(self, arm: str, shapes: KeyShapes) -> Floats:
        """Change (rows, frames, 8) with the jaw of ``arm`` carrying held tissue farther (3),
        turning it (3), and taking it aside (2)."""
        columns = np.zeros((self._layout.rows, len(self.keyframes.chosen), 8))
        for index, frame in enumerate(self.keyframes.chosen):
            trio = [each[index] for each in (shapes.plain, shapes.aside_x, shapes.aside_y)]
            plain, aside_x, aside_y = trio
            if plain is None or aside_x is None or aside_y is None:
                columns[:, index] = np.nan
                continue
            if arm not in plain.shift_by:
                continue
            aside = (aside_x, aside_y)
            beside = [(each.vertices_m - plain.vertices_m)[:, :, None] for each in aside]
            forces = {
                each: np.concatenate(
                    (
                        plain.force_by_shift[each, arm],
                        *((a.forces_n[each] - force_n)[:, None] for a in aside),
                    ),
                    axis=1,
                )
                for each, force_n in plain.forces_n.items()
            }
            columns[:, index] = self._responses[frame].to_surface(
                np.concatenate((plain.shift_by[arm], *beside), axis=2), forces
            )
        return self.keyframes.expanded(columns)

    def _surface_at(self, time_s: float) -> Surface | None:
        """The surface between two frames; None where one is not known."""
        times, surfaces = self._trajectory.time_s, self._frames.surfaces
        after = int(np.clip(np.searchsorted(times, time_s), 1, len(times) - 1))
        before, then = surfaces[after - 1], surfaces[after]
        if before is None or then is None:
            return None
        share = np.clip((time_s - times[after - 1]) / (times[after] - times[after - 1]), 0.0, 1.0)
        return replace(
            then, vertices_m=before.vertices_m + share * (then.vertices_m - before.vertices_m)
        )


def with_values(model: Extension, effect: str, values: Values) -> dict[str, Values]:
    """``model`` with ``values`` of ``effect``."""
    return {**model, effect: {**model.get(effect, {}), **values}}
