import numpy as np
import pytest
import trimesh

from defras_sim.anatomy.refused import RefusedSurface
from defras_sim.anatomy.repair import sound_surface
from defras_sim.anatomy.sides import sides
from defras_sim.anatomy.solid import Sheet, Solid, tissue_of
from tests.sim.anatomy.organs import lumpy_body, lumpy_sheet


def refusal(surface: trimesh.Trimesh, thickness_m: float | None) -> str:
    with pytest.raises(RefusedSurface) as refused:
        tissue_of(sound_surface(surface), thickness_m)
    return str(refused.value)


def test_a_closed_surface_is_the_tissue_itself():
    tissue = tissue_of(sound_surface(lumpy_body()), None)
    assert isinstance(tissue, Solid)
    assert tissue.volume_m3 == pytest.approx(lumpy_body().volume)
    low, high = tissue.vertices_m.min(axis=0), tissue.vertices_m.max(axis=0)
    np.testing.assert_allclose((low + high)[:2], 0.0, atol=1e-12)
    assert low[2] < 0 < high[2]


def test_a_sheet_needs_a_thickness():
    tissue = tissue_of(sound_surface(lumpy_sheet()), 0.005)
    assert isinstance(tissue, Sheet)
    assert tissue.thickness_m == 0.005
    assert "--thickness 5mm" in refusal(lumpy_sheet(), None)


def test_the_flap_of_a_box_is_its_upper_side():
    box = trimesh.creation.box((0.12, 0.10, 0.02))
    tissue = tissue_of(sound_surface(box), 0.005)
    assert isinstance(tissue, Sheet)
    np.testing.assert_allclose(tissue.vertices_m[:, 2], 0.0, atol=1e-12)
    np.testing.assert_allclose(np.ptp(tissue.vertices_m[:, :2], axis=0), [0.12, 0.10])
    area = trimesh.Trimesh(tissue.vertices_m, tissue.triangles, process=False).area
    assert area == pytest.approx(0.12 * 0.10)


def test_the_flap_of_a_body_ends_where_it_gets_steep():
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.05)
    tissue = tissue_of(sound_surface(ball), 0.004)
    radius = np.hypot(*tissue.vertices_m[:, :2].T).max()
    # The slope reaches the limit of 63 degrees at 0.89 of the radius.
    assert radius == pytest.approx(0.0447, abs=0.002)


def test_tissue_on_its_edge_is_refused():
    upright = lumpy_sheet()
    upright.vertices = upright.vertices[:, [2, 0, 1]]
    assert "--up" in refusal(upright, 0.005) or "steeper" in refusal(upright, 0.005)
    wall = trimesh.creation.box((0.001, 0.1, 0.1))
    wall.apply_transform(trimesh.transformations.rotation_matrix(0.8, [0, 1, 0]))
    assert "a height over the plane" in refusal(folded_sheet(), 0.005)


def folded_sheet() -> trimesh.Trimesh:
    """A sheet that comes back under itself."""
    sheet = lumpy_sheet()
    x, y, z = np.array(sheet.vertices).T
    return trimesh.Trimesh(
        np.column_stack([np.where(x > 0.03, 0.06 - x, x), y, z - 0.8 * np.maximum(x - 0.03, 0.0)]),
        sheet.faces,
        process=False,
    )


def test_upper_and_lower_faces_of_a_ball_are_its_caps():
    ball = trimesh.creation.icosphere(subdivisions=4)
    side = sides(np.asarray(ball.vertices), np.asarray(ball.faces))
    height = ball.triangles_center[:, 2]
    assert np.all(side[height > 0.33] == 1)
    assert np.all(side[height < -0.33] == -1)
    assert np.all(side[np.abs(height) < 0.27] == 0)


def test_what_is_covered_is_neither_face():
    under = trimesh.creation.icosphere(subdivisions=3)
    over = under.copy().apply_translation([0, 0, 3])
    both = trimesh.util.concatenate([under, over])
    side = sides(np.asarray(both.vertices), np.asarray(both.faces))
    height = both.triangles_center[:, 2]
    assert np.all(height[side == 1] > 3)
    assert np.all(height[side == -1] < 0)
