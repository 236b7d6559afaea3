import numpy as np
import pytest

from defras_sim.anatomy.curved_face import CurvedFace
from tests.sim.anatomy.organs import disc, lumps_m, lumpy_sheet


@pytest.fixture(scope="module")
def face() -> CurvedFace:
    sheet = lumpy_sheet(rings=40)
    return CurvedFace(np.asarray(sheet.vertices), np.asarray(sheet.faces), 1)


def inner_places(count: int = 300) -> np.ndarray:
    rng = np.random.default_rng(2)
    angle, radius = rng.uniform(0, 2 * np.pi, count), 0.9 * np.sqrt(rng.uniform(0, 1, count))
    return radius[:, None] * np.column_stack([0.06 * np.cos(angle), 0.05 * np.sin(angle)])


def test_heights_and_tangents_are_those_of_the_formula(face):
    places = inner_places()
    points = face.at(places)
    np.testing.assert_allclose(points[:, :2], places, atol=1e-12)
    np.testing.assert_allclose(points[:, 2], lumps_m(*places.T), atol=1e-4)
    step = 1e-6
    slope = (lumps_m(places[:, 0] + step, places[:, 1]) - lumps_m(*places.T)) / step
    first, second = np.moveaxis(face.tangents(places), 1, 0)
    np.testing.assert_allclose(first[:, 2] / first[:, 0], slope, atol=0.06)
    np.testing.assert_allclose(first[:, 1], 0.0, atol=1e-12)
    np.testing.assert_allclose(np.einsum("ni,ni->n", first, second), 0.0, atol=1e-12)
    assert np.all(np.cross(first, second)[:, 2] > 0.5)


def test_shapes_of_places_are_kept(face):
    places = inner_places(12).reshape(3, 4, 2)
    np.testing.assert_array_equal(face.at(places).reshape(-1, 3), face.at(places.reshape(-1, 2)))
    assert face.tangents(places).shape == (3, 4, 2, 3)


def test_places_outside_are_brought_to_the_nearest_of_the_rim():
    points, triangles = disc(12)
    flat = CurvedFace(np.column_stack([0.05 * points, np.full(len(points), 0.01)]), triangles, 1)
    angle = np.linspace(0, 2 * np.pi, 50)
    ways = np.column_stack([np.cos(angle), np.sin(angle)])
    outside, inside = 0.08 * ways, 0.049 * ways
    assert not flat.covers(outside).any()
    assert flat.covers(inside).all()
    np.testing.assert_allclose(flat.at(outside)[:, :2], 0.05 * ways, atol=1e-3)
    np.testing.assert_allclose(flat.at(outside)[:, 2], 0.01)
    np.testing.assert_allclose(flat.rim_distance_m(0.03 * ways), 0.02, atol=2e-4)


def test_inset_places_have_room_and_lie_as_near_as_can_be(face):
    for angle in np.linspace(0.1, 6, 7):
        wanted = np.array([0.059 * np.cos(angle), 0.049 * np.sin(angle)])
        found = face.inset(wanted, 0.005)
        assert face.rim_distance_m(found[None])[0] >= 0.005
        assert np.linalg.norm(found - wanted) < 0.0062
    middle = np.array([0.001, 0.002])
    np.testing.assert_array_equal(face.inset(middle, 0.005), middle)
    # No place of an oval of 50 mm has 70 mm of room: the middle has most.
    assert np.linalg.norm(face.inset(middle, 0.07)) < 0.02


@pytest.mark.parametrize(("sign", "height_m"), [(1, 0.03), (-1, -0.02)])
def test_of_several_layers_the_outermost_counts(sign, height_m):
    points, triangles = disc(4)
    layers = [np.column_stack([points, np.full(len(points), z)]) for z in (-0.02, 0.0, 0.03)]
    numbers = np.concatenate([triangles + k * len(points) for k in range(3)])
    face = CurvedFace(np.concatenate(layers), numbers, sign)
    np.testing.assert_allclose(face.at(0.5 * points)[:, 2], height_m)
