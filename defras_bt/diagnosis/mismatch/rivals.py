"""Explanations of a mismatch that leave the attachments as they are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from defras_bt.diagnosis.mismatch.finding import MismatchCause
from defras_bt.learning.estimate import Keyframe
from defras_bt.learning.misfit import misfit
from defras_bt.learning.registration import fitted_registration
from defras_bt.learning.replay import NotRepeatable, Replay
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Camera, Scene
from defras_sim.surface import Surface

STILL = Pose(np.zeros(3))

_PROBE_M = 0.003
_ITERATIONS = 8
_ROBUST_M = 0.004
_FARTHEST_M = 0.04
_ALONG = 0.8
"""Cosine with the way back to where tissue was taken from which on it has slipped."""


@dataclass(frozen=True)
class Rival:
    """One explanation: the surface and the true_from_reported of each keyframe.

    ``size`` says in words how much it takes.
    """

    cause: MismatchCause
    surfaces: tuple[Surface, ...]
    moved: tuple[Pose, ...]
    size: str


def moved_cameras(
    points_m: Sequence[Floats], surfaces: Sequence[Surface], camera: Camera
) -> Iterator[Rival]:
    """The camera was moved before a frame, for each frame to which it could have been.

    ``points_m`` are those to be fitted (n, 3), empty for frames that are not.
    """
    fitted = [i for i, points in enumerate(points_m) if len(points)]
    for number, first in enumerate(fitted):
        later = fitted[number:]
        found = fitted_registration(
            [points_m[i] for i in later], [surfaces[i] for i in later], camera
        )
        if found is None:
            continue
        # Frames between the last one not moved and this one may belong to either.
        begin = fitted[number - 1] + 1 if number else 0
        for onset in range(begin, first + 1):
            moved = tuple(found if i >= onset else STILL for i in range(len(surfaces)))
            pivot_m = np.array(camera.target_m)
            shift_mm = 1e3 * float(np.linalg.norm(found.apply(pivot_m) - pivot_m))
            turn_deg = np.degrees(float(Rotation.from_matrix(found.rotation).magnitude()))
            size = f"by {shift_mm:.1f} mm and {turn_deg:.1f} degrees"
            yield Rival("camera", tuple(surfaces), moved, size)


def moved_patches(
    points_m: Sequence[Floats],
    replay: Replay,
    keyframes: Sequence[Keyframe],
    surfaces: Sequence[Surface],
    camera: Camera,
) -> Iterator[Rival]:
    """What an arm holds has been elsewhere than its tip since a frame.

    Back towards where it was taken, it slipped in the jaw; in any other direction, the arm is not
    where it is told to be. The stiffness of the holes is that of the replay's last call.
    """
    fitted = [i for i, points in enumerate(points_m) if len(points)]
    for arm in keyframes[0].tips:
        linear = {i: _slopes(replay, i, arm, surfaces[i]) for i in fitted}
        for number, first in enumerate(fitted):
            begin = fitted[number - 1] + 1 if number else 0
            found = _fitted_shift(points_m, surfaces, linear, fitted[number:], camera)
            if found is None:
                continue
            shifted = _shifted(replay, begin, len(surfaces), arm, found)
            for onset in range(begin, first + 1):
                later = [shifted[frame] for frame in range(onset, len(surfaces))]
                if all(surface is not None for surface in later):
                    shapes = (*surfaces[:onset], *(s for s in later if s is not None))
                    yield _patch(keyframes, shapes, arm, found, onset)


def moved_arms(
    points_m: Sequence[Floats],
    belief: Scene,
    keyframes: Sequence[Keyframe],
    surfaces: Sequence[Surface],
) -> Iterator[Rival]:
    """The arms are registered to the tissue with an error: all of them have been off by the same
    all along, and took the tissue beside where they should have.

    An error in height changes nothing: a jaw that closes higher holds the same tissue, and carries
    it as far.
    """
    camera = belief.depth_camera
    fitted = [i for i, points in enumerate(points_m) if len(points)]
    shown = [keyframes[i] for i in fitted]
    columns = []
    for axis in np.eye(3)[:2]:
        shapes = _registered(belief, shown, _PROBE_M * axis)
        if shapes is None:
            return
        columns.append(
            [
                (shape.vertices_m - surfaces[i].vertices_m) / _PROBE_M
                for i, shape in zip(fitted, shapes, strict=True)
            ]
        )
    linear = {i: np.stack(both, axis=2) for i, *both in zip(fitted, *columns, strict=True)}
    beside_m = _fitted_shift(points_m, surfaces, linear, fitted, camera)
    if beside_m is None:
        return
    shift_m = np.array([*beside_m, 0.0])
    shapes = _registered(belief, keyframes, shift_m)
    if shapes is None:
        return
    size = f"by {1e3 * float(np.linalg.norm(shift_m)):.1f} mm"
    yield Rival("arm", shapes, (STILL,) * len(shapes), size)


def _registered(
    belief: Scene, keyframes: Sequence[Keyframe], shift_m: Floats
) -> tuple[Surface, ...] | None:
    """Surfaces if every tip were ``shift_m`` (3,) off, also when its jaw closed; None where the
    model does not follow."""
    moved = [
        replace(
            frame,
            grasp_tips={arm: tip.moved(shift_m) for arm, tip in frame.grasp_tips.items()},
            tips={arm: tip.moved(shift_m) for arm, tip in frame.tips.items()},
        )
        for frame in keyframes
    ]
    try:
        states = Replay(belief, moved).repeat(belief.hole_stiffness_n_per_m(belief.attached))
    except NotRepeatable:
        return None
    return tuple(state.surface for state in states)


def _slopes(replay: Replay, frame: int, arm: str, surface: Surface) -> Floats | None:
    """Motion (vertices, 3, 3) of the surface per metre of motion of the held patch along x, y, z;
    None where the model does not follow."""
    columns = []
    for axis in np.eye(3):
        state = replay.displaced(frame, {arm: _PROBE_M * axis})
        if state is None:
            return None
        columns.append((state.surface.vertices_m - surface.vertices_m) / _PROBE_M)
    return np.stack(columns, axis=2)


def _fitted_shift(
    points_m: Sequence[Floats],
    surfaces: Sequence[Surface],
    linear: Mapping[int, Floats | None],
    frames: Sequence[int],
    camera: Camera,
) -> Floats | None:
    """Shift (k,) of the patch that brings ``frames`` closest to their points, by the slopes
    (vertices, 3, k).

    Gauss-Newton with Huber's weights; None where the model does not follow, or sees nothing.
    """
    known = [slopes for slopes in linear.values() if slopes is not None]
    if not known:
        return None
    shift_m = np.zeros(known[0].shape[2])
    for _ in range(_ITERATIONS):
        rows, sides = [], []
        for frame in frames:
            slopes, before = linear[frame], surfaces[frame]
            if slopes is None:
                return None
            vertices_m = before.vertices_m + slopes @ shift_m
            surface = Surface(vertices_m, before.triangles, before.upper, before.rest_xy_m)
            compared = misfit(points_m[frame], surface, camera)
            if compared is None:
                return None
            weight = np.sqrt(
                np.minimum(1.0, _ROBUST_M / np.maximum(np.abs(compared.residual_m), 1e-12))
            )
            rows.append(weight[:, None] * compared.jacobian(slopes))
            sides.append(-weight * compared.residual_m)
        step = np.linalg.lstsq(np.concatenate(rows), np.concatenate(sides), rcond=1e-6)[0]
        shift_m = shift_m + step
        size_m = float(np.linalg.norm(shift_m))
        if size_m > _FARTHEST_M:
            shift_m *= _FARTHEST_M / size_m
        if float(np.abs(step).max()) < 2e-5:
            break
    return shift_m


def _shifted(
    replay: Replay, begin: int, end: int, arm: str, shift_m: Floats
) -> dict[int, Surface | None]:
    """Shapes of the frames from ``begin`` on with the patch of ``arm`` moved, as the model really
    has them; None where it does not follow."""
    found: dict[int, Surface | None] = {}
    for frame in range(begin, end):
        state = replay.displaced(frame, {arm: shift_m})
        found[frame] = None if state is None else state.surface
    return found


def _patch(
    keyframes: Sequence[Keyframe],
    shapes: tuple[Surface, ...],
    arm: str,
    shift_m: Floats,
    onset: int,
) -> Rival:
    """The explanation that the patch of ``arm`` has been ``shift_m`` (3,) off since ``onset``."""
    size_m = float(np.linalg.norm(shift_m))
    slipped = False
    for back_m in _ways_back_m(keyframes, arm, onset):
        way_m = float(np.linalg.norm(back_m))
        along = float(shift_m @ back_m) / max(size_m * way_m, 1e-12)
        slipped |= along >= _ALONG and size_m <= way_m + _PROBE_M
    return Rival(
        "grasp" if slipped else "arm",
        shapes,
        (STILL,) * len(shapes),
        f"{f'of {arm.upper()} ' if slipped else ''}by {1e3 * size_m:.1f} mm",
    )


def _ways_back_m(keyframes: Sequence[Keyframe], arm: str, onset: int) -> list[Floats]:
    """Ways (3,) back to where the tissue was taken, from places at which the tip may have been when
    it slipped: some time after the frame before ``onset``."""
    here = keyframes[onset]
    taken_m = here.grasp_tips[arm].position_m
    now_m = here.tips[arm].position_m
    before_m = taken_m if onset == 0 else keyframes[onset - 1].tips[arm].position_m
    return [taken_m - (now_m + share * (before_m - now_m)) for share in (0.0, 0.25, 0.5, 0.75)]
