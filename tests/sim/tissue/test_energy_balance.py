"""No energy comes from nowhere: slow motions of the tip, and the work that is done on the way."""

import numpy as np
import pytest

from defras_sim.geometry import Pose
from defras_sim.scene import Attachments, Roi, Scene, Tissue
from defras_sim.tissue.model import TissueModel

SCENE = Scene(
    name="side",
    attachments=Attachments(map=("##..........",) * 12),
    roi=Roi(center_x_m=0.0, center_y_m=0.0),
    tissue=Tissue(bed=False),
)
START = Pose(np.array([0.045, 0.01, 0.0]))
ROUND_M = 0.01
CENTER_M = np.array([-0.01, 0.0, 0.02])
STEPS = 48


def circle(angle: float) -> np.ndarray:
    return CENTER_M + ROUND_M * np.array([np.cos(angle), np.sin(angle), 0.5 * np.sin(2 * angle)])


@pytest.mark.parametrize("material", ["neo_hookean", "corotational"])
def test_a_closed_slow_loop_costs_no_work_and_half_of_it_what_the_energy_says(material):
    tissue = TissueModel(SCENE, elements_xyz=(6, 6, 1), material=material, residual_share=1e-6)
    tissue.grasp("psm1", START)
    forces, energies, places = [], [], []
    for angle in np.linspace(0, 2 * np.pi, STEPS + 1):
        place = circle(angle)
        state = tissue.solve({"psm1": START.moved(place)})
        assert state.converged
        forces.append(state.grasp_forces_n["psm1"])
        energies.append(
            sum(term.energy_and_gradient(state.nodes_m)[0] for term in tissue.terms.values())
        )
        places.append(place)
    steps = np.diff(places, axis=0)
    middle = (np.array(forces)[1:] + np.array(forces)[:-1]) / 2
    work = np.cumsum(np.sum(middle * steps, axis=1))
    gained = np.array(energies)[1:] - energies[0]
    swing = np.ptp(work)
    # The trapezoidal rule is off by some thousandths of the swing on so few steps.
    assert abs(work[-1]) < 0.005 * swing
    assert abs(gained[-1]) < 1e-4 * swing
    np.testing.assert_allclose(work, gained, atol=0.01 * swing)
