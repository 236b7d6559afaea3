"""psm.urdf and the DH rows describe the same arm."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pybullet
import pytest
from pybullet_utils.bullet_client import BulletClient

from defras_sim.arm.dh import JOINT_HIGH, JOINT_LOW, JOINT_NAMES, JOINT_SPEED, link_poses
from defras_sim.arm.kinematics import tip_pose
from defras_sim.resources import resource

RCM_M = np.array([0.0, 0.09, 0.2])


@pytest.fixture
def client() -> Iterator[Any]:
    connected = BulletClient(connection_mode=pybullet.DIRECT)
    yield connected
    connected.disconnect()


@pytest.fixture
def arm(client: Any) -> int:
    return client.loadURDF(str(resource("sim/robots/psm.urdf")), list(RCM_M), useFixedBase=True)


def pose_of(client: Any, arm: int, link: int) -> tuple[np.ndarray, np.ndarray]:
    state = client.getLinkState(arm, link, computeForwardKinematics=1)
    rotation = np.reshape(client.getMatrixFromQuaternion(state[5]), (3, 3))
    return np.array(state[4]) - RCM_M, rotation


def test_every_link_stands_where_the_dh_rows_say(client, arm):
    rng = np.random.default_rng(0)
    for _ in range(20):
        joints = rng.uniform(JOINT_LOW, JOINT_HIGH)
        for index, value in enumerate(joints):
            client.resetJointState(arm, index, value)
        for link, expected in enumerate(link_poses(joints)):
            position_m, rotation = pose_of(client, arm, link)
            np.testing.assert_allclose(position_m, expected.position_m, atol=1e-5)
            np.testing.assert_allclose(rotation, expected.rotation, atol=1e-4)
        position_m, rotation = pose_of(client, arm, 8)
        np.testing.assert_allclose(position_m, tip_pose(joints).position_m, atol=1e-5)
        np.testing.assert_allclose(rotation, tip_pose(joints).rotation, atol=1e-4)


def test_names_and_limits(client, arm):
    for index, name in enumerate(JOINT_NAMES):
        info = client.getJointInfo(arm, index)
        assert info[1].decode() == name
        assert info[8] == pytest.approx(JOINT_LOW[index], abs=1e-6)
        assert info[9] == pytest.approx(JOINT_HIGH[index], abs=1e-6)
        assert info[11] == pytest.approx(JOINT_SPEED[index], rel=1e-4)


def test_the_remote_centre_stays(client, arm):
    """The shaft's line stays within 0.1 mm of the remote centre whatever the joints do."""
    rng = np.random.default_rng(3)
    for _ in range(50):
        for index, value in enumerate(rng.uniform(JOINT_LOW, JOINT_HIGH)):
            client.resetJointState(arm, index, value)
        end_m, rotation = pose_of(client, arm, 3)
        assert np.linalg.norm(np.cross(end_m, rotation[:, 2])) < 1e-4
