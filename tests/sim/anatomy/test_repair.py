import numpy as np
import pytest
import trimesh

from defras_sim.anatomy.refused import RefusedSurface
from defras_sim.anatomy.repair import sound_surface
from tests.sim.anatomy.organs import lumpy_body, lumpy_sheet


def mesh(vertices, triangles) -> trimesh.Trimesh:
    return trimesh.Trimesh(vertices, triangles, process=False)


def refusal(broken: trimesh.Trimesh) -> str:
    with pytest.raises(RefusedSurface) as refused:
        sound_surface(broken)
    return str(refused.value)


def test_a_sound_surface_stays_as_it_is():
    body, sheet = sound_surface(lumpy_body()), sound_surface(lumpy_sheet())
    assert body.closed
    assert not sheet.closed
    assert body.repairs == sheet.repairs == ()
    assert len(body.triangles) == len(lumpy_body().faces)


def test_soup_as_in_stl_files_is_joined():
    body = lumpy_body()
    soup = mesh(body.triangles.reshape(-1, 3), np.arange(3 * len(body.faces)).reshape(-1, 3))
    joined = sound_surface(soup)
    assert joined.closed
    assert len(joined.vertices_m) == len(body.vertices)
    assert "merged" in joined.repairs[0]


def test_empty_and_repeated_triangles_are_left_out():
    body = lumpy_body()
    extra = np.concatenate([body.faces, body.faces[:3], [[0, 0, 1]]])
    mended = sound_surface(mesh(body.vertices, extra))
    assert len(mended.triangles) == len(body.faces)
    assert mended.repairs == ("left out 4 empty or repeated triangles",)


@pytest.mark.parametrize("organ", [lumpy_body, lumpy_sheet])
def test_flipped_triangles_are_turned_back(organ):
    whole = organ()
    flipped = np.array(whole.faces)
    flipped[::7] = flipped[::7, ::-1]
    mended = sound_surface(mesh(whole.vertices, flipped))
    a, b, c = np.moveaxis(mended.vertices_m[mended.triangles], 1, 0)
    if mended.closed:
        assert np.sum(a * np.cross(b, c)) / 6 == pytest.approx(whole.volume)
    else:
        assert np.all(np.cross(b - a, c - a)[:, 2] > 0)
    assert any("turned" in repair for repair in mended.repairs)


def test_a_surface_that_is_inside_out_is_turned():
    body = lumpy_body()
    mended = sound_surface(mesh(body.vertices, np.array(body.faces)[:, ::-1]))
    a, b, c = np.moveaxis(mended.vertices_m[mended.triangles], 1, 0)
    assert np.sum(a * np.cross(b, c)) > 0
    assert mended.repairs == ("turned the surface inside out",)


def test_small_holes_are_closed_and_large_ones_are_not():
    body = lumpy_body(subdivisions=4)
    around = np.any(body.faces == 17, axis=1)
    mended = sound_surface(mesh(body.vertices, body.faces[~around]))
    assert mended.closed
    assert mended.repairs[-1] == "closed 1 small hole"
    a, b, c = np.moveaxis(mended.vertices_m[mended.triangles], 1, 0)
    assert np.sum(a * np.cross(b, c)) / 6 == pytest.approx(body.volume, rel=0.01)
    ends = np.abs(body.triangles_center[:, 0]) > 0.035
    assert "2 rims" in refusal(mesh(body.vertices, body.faces[~ends]))


def test_two_bodies_are_refused():
    body = lumpy_body()
    both = trimesh.util.concatenate([body, body.copy().apply_translation([0.2, 0, 0])])
    assert "2 separate bodies (of 1280, 1280 triangles)" in refusal(both)


def test_surfaces_that_are_no_surfaces_are_refused():
    body = lumpy_body()
    fin = np.vstack([body.vertices, [[0.0, 0.0, 0.1]]])
    with_fin = np.vstack([body.faces, [[*body.faces[0, :2], len(body.vertices)]]])
    assert "1 edges belong to more than two triangles" in refusal(mesh(fin, with_fin))
    # Two tetrahedra that share one corner.
    corners = np.array(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]]
    )
    one = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    other = np.array([[0, 5, 4], [0, 4, 6], [4, 5, 6], [0, 6, 5]])
    message = refusal(mesh(0.05 * corners, np.vstack([one, other])))
    assert "touch in 1 single vertices" in message or "separate bodies" in message


def test_a_strip_with_one_side_is_refused():
    turn = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    across = np.array([-0.01, 0.01])
    radius = 0.05 + np.cos(turn / 2)[:, None] * across
    strip = np.stack(
        [
            radius * np.cos(turn)[:, None],
            radius * np.sin(turn)[:, None],
            np.sin(turn / 2)[:, None] * across,
        ],
        axis=-1,
    ).reshape(-1, 3)
    here = np.arange(40)
    a, b, c, d = 2 * here, 2 * here + 1, 2 * here + 2, 2 * here + 3
    c[-1], d[-1] = 1, 0  # joined after half a turn
    triangles = np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])
    assert "one side only" in refusal(mesh(strip, triangles))


@pytest.mark.parametrize("depth_m", [0.008, 0.02])
def test_a_surface_that_cuts_itself_is_refused_with_the_place(depth_m):
    sheet = lumpy_sheet()
    x, y, z = np.array(sheet.vertices).T
    # The rim at the right is led back under the sheet and up through it.
    folded = np.where(x > 0.03, 0.06 - x, x)
    crossing = z - np.where(x > 0.03, depth_m - (x - 0.03) * 2, 0.0)
    message = refusal(mesh(np.column_stack([folded, y, crossing]), sheet.faces))
    assert "cuts itself near" in message
    assert "common edge or corner only" in message
