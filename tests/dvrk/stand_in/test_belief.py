"""A laboratory that has measured its robot knows its joints, and not how it is registered."""

import pytest

from defras_bt.dvrk.stand_in.belief import measured_belief
from defras_bt.dvrk.stand_in.imperfections import Imperfections, read_imperfections
from defras_sim.resources import resource
from defras_sim.rest_shape import NotASlab
from defras_sim.scene import load_scene

LAB = read_imperfections("lab")
SCENE = load_scene(resource("sim/scenes/A_fewer.yaml"))


def test_joints_are_known_and_registrations_are_not():
    known = measured_belief(SCENE, LAB, "model").model.extension
    assert set(known) == {"servo_lag", "joint_play", "joint_coupling"}
    assert all(dict(known[name]) == dict(LAB.extension[name]) for name in known)


def test_what_was_adopted_before_stays():
    stiffer = SCENE.extended({"stiffness": {"scale": 1.2}})
    assert "stiffness" in measured_belief(stiffer, LAB, "model").model.extension


def test_beside_pybullet_the_twin_shares_its_tissue():
    assert measured_belief(SCENE, Imperfections(), "model") == SCENE
    assert measured_belief(SCENE, Imperfections(), "bullet") == SCENE.for_bullet()
    with pytest.raises(NotASlab):
        measured_belief(load_scene(resource("sim/scenes/flap.yaml")), LAB, "bullet")
