"""What is wrong with a scene whose parts are each well-formed: they must fit together."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from defras_sim.effects.adoption import adoption_faults
from defras_sim.yaml_source import Location

if TYPE_CHECKING:
    from defras_sim.anatomy.anatomy import Anatomy
    from defras_sim.scene import Scene

SceneFault = tuple[Location, str]
"""Where in the file, and what is wrong with it and what would be valid."""

_ROUNDING_M = 1e-12
_MOST_ELEMENTS = 64
"""Along one side. A mesh this fine already needs minutes for one step."""
_MOST_HOLES = 2500
_BOX_TOLERANCE_M = 5e-4
_MOST_SAG = 0.2
"""Of weight over an area to Young's modulus: about how much thinner lying makes the tissue."""


def scene_faults(scene: Scene) -> Iterator[SceneFault]:
    """Every fault of ``scene``; none if it can be used."""
    nx, ny = scene.hole_counts
    if nx < 1 or ny < 1:
        pitch_m, tissue = scene.attachments.hole_pitch_m, scene.tissue
        yield (
            ("attachments", "hole_pitch_m"),
            f"attachments.hole_pitch_m: {pitch_m} leaves no hole under the tissue; at most "
            f"{min(tissue.length_x_m, tissue.width_y_m)}",
        )
        return  # the map cannot be judged
    if nx * ny > _MOST_HOLES:
        least_m = np.sqrt(scene.tissue.length_x_m * scene.tissue.width_y_m / _MOST_HOLES)
        yield (
            ("attachments", "hole_pitch_m"),
            f"attachments.hole_pitch_m: {scene.attachments.hole_pitch_m} makes {nx} x {ny} holes; "
            f"at least {least_m:.4f} keeps them below {_MOST_HOLES}",
        )
        return
    yield from _attachment_faults(scene)
    yield from _place_faults(scene)
    yield from _weight_faults(scene)
    yield from _mesh_faults(scene)
    yield from _setup_faults(scene)
    yield from adoption_faults(scene)
    yield from _advice_faults(scene)


def _attachment_faults(scene: Scene) -> Iterator[SceneFault]:
    nx, ny = scene.hole_counts
    rows = scene.attachments.map
    if scene.tissue.anatomy is not None and all(len(row) == nx for row in rows) and len(rows) == ny:
        yield from _blank_faults(scene)
        rows = tuple(row.replace(" ", ".") for row in rows)
    if len(rows) != ny:
        yield ("attachments", "map"), f"attachments.map: {len(rows)} rows, needs {ny}"
    for i, row in enumerate(rows):
        if len(row) != nx or set(row) - {"#", "."}:
            message = f"attachments.map.{i}: {row!r} should be {nx} characters, each # or ."
            yield ("attachments", "map", i), message
    if not any("#" in row for row in rows):
        message = "attachments.map: no hole holds the tissue; mark at least one with #"
        yield ("attachments", "map"), message


def _blank_faults(scene: Scene) -> Iterator[SceneFault]:
    """The map of an anatomy's holes is blank where there is no tissue, and only there."""
    nx, ny = scene.hole_counts
    for i, (row, is_hole) in enumerate(
        zip(scene.attachments.map, scene.is_hole.reshape(ny, nx)[::-1], strict=True)
    ):
        wrong = [k for k, mark in enumerate(row) if (mark == " ") == is_hole[k]]
        if wrong:
            valid = "".join(
                ("#" if m == "#" else ".") if h else " " for m, h in zip(row, is_hole, strict=True)
            )
            yield (
                ("attachments", "map", i),
                f"attachments.map.{i}: {row!r} should be blank where there is no tissue, and only "
                f"there, as in {valid!r}",
            )


def _anatomy_faults(scene: Scene, anatomy: Anatomy) -> Iterator[SceneFault]:
    tissue = scene.tissue
    if tissue.element != "tetrahedron10":
        message = f"tissue.element: {tissue.element}; an anatomy's meshes are of tetrahedron10"
        yield ("tissue", "element"), message
    size_m = anatomy.high_m - anatomy.low_m
    for key, is_m, should_m in (
        ("length_x_m", tissue.length_x_m, size_m[0]),
        ("width_y_m", tissue.width_y_m, size_m[1]),
    ):
        if abs(is_m - should_m) > _BOX_TOLERANCE_M:
            message = f"tissue.{key}: {is_m}; the anatomy measures {should_m:.4f}"
            yield ("tissue", key), message
    turn = np.linspace(0, 2 * np.pi, 32, endpoint=False)
    rim_m = scene.roi.radius_m * np.column_stack([np.cos(turn), np.sin(turn)])
    if not anatomy.covers(scene.roi_center_m[:2] + rim_m).all():
        yield (
            ("roi", "center_x_m"),
            f"roi: a disc of radius {scene.roi.radius_m} around ({scene.roi.center_x_m}, "
            f"{scene.roi.center_y_m}) reaches out from under the tissue; valid is a disc wholly "
            "below it",
        )
    if not scene.grasp_points:
        message = "grasp: no place of the grid has tissue; more columns and rows may find some"
        yield ("grasp",), message


def _place_faults(scene: Scene) -> Iterator[SceneFault]:
    """Region and grasp points have to lie on the tissue."""
    if scene.tissue.anatomy is not None:
        yield from _anatomy_faults(scene, scene.tissue.anatomy)
        return
    roi, grid = scene.roi, scene.grasp
    half_m = np.array([scene.tissue.length_x_m, scene.tissue.width_y_m]) / 2
    for axis, center_m, most_m in zip("xy", (roi.center_x_m, roi.center_y_m), half_m, strict=True):
        limit_m = most_m - roi.radius_m
        if abs(center_m) > limit_m + _ROUNDING_M:
            yield (
                ("roi", f"center_{axis}_m"),
                f"roi.center_{axis}_m: {center_m} puts the region outside the tissue; "
                f"valid is -{limit_m:.4f} to {limit_m:.4f} for radius {roi.radius_m}",
            )
    room_m = float(half_m.min()) - grid.patch_radius_m
    if grid.margin_m > room_m + _ROUNDING_M and max(grid.columns, grid.rows) > 1:
        yield (
            ("grasp", "margin_m"),
            f"grasp.margin_m: {grid.margin_m} leaves no room for grasp points; at most "
            f"{max(room_m, 0.0):.4f} for patch_radius_m {grid.patch_radius_m}",
        )


def _weight_faults(scene: Scene) -> Iterator[SceneFault]:
    """Heavy tissue has to lie on something, and to keep its shape while it does."""
    tissue = scene.tissue
    if tissue.gravity_m_s2 == 0.0:
        return
    if not tissue.bed:
        yield (
            ("tissue", "gravity_m_s2"),
            f"tissue.gravity_m_s2: {tissue.gravity_m_s2} lets tissue without a bed hang where no "
            "grasp point is; give it its bed (bed: true), or no gravity",
        )
    pressure_pa = tissue.density_kg_m3 * tissue.gravity_m_s2 * tissue.thickness_m
    if pressure_pa > _MOST_SAG * tissue.young_modulus_pa:
        yield (
            ("tissue", "young_modulus_pa"),
            f"tissue.young_modulus_pa: {tissue.young_modulus_pa} is too soft to carry its own "
            f"weight; at least {pressure_pa / _MOST_SAG:.0f} for this thickness and density",
        )


def _mesh_faults(scene: Scene) -> Iterator[SceneFault]:
    for place, counts in (
        (("tissue", "elements_xyz"), scene.tissue.elements_xyz),
        (("simulation", "elements_xyz"), scene.simulation.elements_xyz),
        (("simulation", "bullet_elements_xyz"), scene.simulation.bullet_elements_xyz),
    ):
        if min(counts) < 1 or max(counts) > _MOST_ELEMENTS:
            yield (
                place,
                f"{'.'.join(place)}: {list(counts)}; each count should be 1 or more, "
                f"at most {_MOST_ELEMENTS}",
            )


def _setup_faults(scene: Scene) -> Iterator[SceneFault]:
    delta_m = scene.thresholds.delta_m
    if not delta_m[0] < delta_m[1] < delta_m[2]:
        yield ("thresholds", "delta_m"), f"thresholds.delta_m: {list(delta_m)} should increase"
    if not scene.arms:
        yield ("arms",), "arms: needs at least one arm; valid: psm1, psm2"
    for name, camera in (("endoscope", scene.endoscope), ("depth_camera", scene.depth_camera)):
        if np.hypot(*np.subtract(camera.target_m, camera.position_m)[:2]) < 1e-6:
            message = f"{name}: looks straight up or down; move position_m or target_m sideways"
            yield (name, "position_m"), message


def _advice_faults(scene: Scene) -> Iterator[SceneFault]:
    names: set[str] = set()
    for i, advice in enumerate(scene.advice):
        point, grid = advice.matter.point, scene.grasp
        if point is not None and point not in scene.grasp_points:
            message = (
                f"advice.{i}: {point} is no grasp point; valid are (1,1) to "
                f"({grid.columns},{grid.rows})"
            )
            yield ("advice", i, advice.kind), message
        if advice.name in names:
            message = f"advice.{i}: another rule is named {advice.name!r} already"
            yield ("advice", i, "name"), message
        names.add(advice.name)
