import numpy as np
import pytest

from defras_sim.tissue.elements import gauss_hexahedron
from defras_sim.tissue.graded_mesh import graded_breaks, graded_mesh
from defras_sim.tissue.material_points import MaterialPoints


def mesh():
    return graded_mesh(
        (
            graded_breaks(-0.02, 0.03, 0.0, 0.002, 0.004, 1.7),
            graded_breaks(-0.01, 0.01, -0.004, 0.002, 0.002, 2.0),
            graded_breaks(-0.005, 0.0, 0.0, 0.001, 0.0, 2.0),
        )
    )


def test_layers_are_fine_at_the_centre_and_end_where_they_should():
    breaks = graded_breaks(-0.02, 0.03, 0.0, 0.002, 0.004, 1.7)
    assert (breaks[0], breaks[-1]) == pytest.approx((-0.02, 0.03))
    assert np.all(np.diff(breaks) > 0)
    assert np.abs(breaks).min() == 0.0
    widths = np.diff(breaks)
    assert widths[np.searchsorted(breaks, 1e-9) - 1] < 0.003 < widths[-1]


def test_elements_fill_the_box():
    volumes = MaterialPoints.of(mesh(), gauss_hexahedron(2)).volumes_m3
    assert volumes.sum() == pytest.approx(0.05 * 0.02 * 0.005)


def test_interpolation_reproduces_quadratic_fields():
    box = mesh()
    points = np.random.default_rng(0).uniform([-0.02, -0.01, -0.005], [0.03, 0.01, 0.0], (40, 3))

    def field(x: np.ndarray) -> np.ndarray:
        return 1 + x[:, 0] ** 2 - 3 * x[:, 1] * x[:, 2] + x[:, 2] ** 2 + x[:, 1]

    np.testing.assert_allclose(
        box.interpolation(points) @ field(box.nodes_m), field(points), atol=1e-12
    )


def test_a_point_outside_is_refused():
    with pytest.raises(ValueError, match="outside the box"):
        mesh().interpolation(np.array([[0.0, 0.02, 0.0]]))
