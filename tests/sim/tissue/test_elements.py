import numpy as np
import pytest

from defras_sim.tissue.elements import (
    HEXAHEDRON20_NODES,
    gauss_hexahedron,
    irons_hexahedron,
    quadrature,
    shape_gradients,
    shape_values,
)
from defras_sim.tissue.tetrahedra import TETRAHEDRON10_NODES

TETRAHEDRON_NODES = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)


def inner_points(count: int = 20) -> np.ndarray:
    return np.random.default_rng(1).uniform(0.05, 0.3, (count, 3))


@pytest.mark.parametrize(
    ("element", "nodes"),
    [
        ("hexahedron20", HEXAHEDRON20_NODES),
        ("tetrahedron10", TETRAHEDRON10_NODES),
        ("tetrahedron4", TETRAHEDRON_NODES),
    ],
)
def test_each_shape_function_is_one_at_its_own_node_only(element, nodes):
    np.testing.assert_allclose(shape_values(element, nodes), np.eye(len(nodes)), atol=1e-14)


@pytest.mark.parametrize("element", ["hexahedron20", "tetrahedron10", "tetrahedron4"])
def test_shape_functions_sum_to_one_and_gradients_match_differences(element):
    points = inner_points()
    np.testing.assert_allclose(shape_values(element, points).sum(axis=1), 1.0)
    gradients = shape_gradients(element, points)
    for axis in range(3):
        step = np.eye(3)[axis] * 1e-6
        difference = shape_values(element, points + step) - shape_values(element, points - step)
        np.testing.assert_allclose(gradients[:, :, axis], difference / 2e-6, atol=1e-8)


def test_serendipity_element_represents_quadratic_fields():
    points = inner_points()

    def field(x):
        return x[:, 0] ** 2 - 3 * x[:, 1] * x[:, 2] + x[:, 2] ** 2 + x[:, 0] * x[:, 1] * x[:, 2]

    values = shape_values("hexahedron20", points) @ field(HEXAHEDRON20_NODES)
    np.testing.assert_allclose(values, field(points), atol=1e-13)


@pytest.mark.parametrize(
    ("rule", "degree"),
    [(gauss_hexahedron(2), 3), (gauss_hexahedron(3), 5), (irons_hexahedron(), 5)],
)
def test_hexahedron_rules_integrate_polynomials_of_their_degree(rule, degree):
    for i in range(degree + 1):
        for j in range(degree + 1 - i):
            k = degree - i - j
            exact = np.prod([2 / (p + 1) if p % 2 == 0 else 0.0 for p in (i, j, k)])
            x, y, z = rule.points.T
            assert np.sum(rule.weights * x**i * y**j * z**k) == pytest.approx(exact, abs=1e-12)


def test_tetrahedron_rule_gives_the_volume():
    assert quadrature("tetrahedron4", (2, 2, 1)).weights.sum() == pytest.approx(1 / 6)


def test_narrow_meshes_are_not_integrated_at_eight_points():
    assert len(quadrature("hexahedron20", (8, 8, 1)).weights) == 8
    assert len(quadrature("hexahedron20", (8, 1, 1)).weights) == 14
