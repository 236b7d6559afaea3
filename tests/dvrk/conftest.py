"""A real ROS 1 master for tests of the dVRK: on the loopback, with files of its own."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from defras_bt.dvrk.ros_packages import RosMissing, ros_module
from defras_bt.dvrk.stand_in.ros_master import RosMaster
from defras_bt.dvrk.stand_in.stand_in_process import StandInProcess

StartStandIn = Callable[..., StandInProcess]


@pytest.fixture(scope="session")
def ros_master(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RosMaster]:
    """The master of this process's tests. A process can join only one in its life."""
    try:
        ros_module("rospy")
        master = RosMaster(tmp_path_factory.mktemp("ros"))
        master.__enter__()
    except RosMissing as error:
        pytest.skip(str(error))
    before = dict(os.environ)
    os.environ.update(master.environment)
    try:
        yield master
    finally:
        master.kill()
        os.environ.clear()
        os.environ.update(before)


@pytest.fixture
def start_stand_in(ros_master: RosMaster, tmp_path: Path) -> Iterator[StartStandIn]:
    """Starts ``defras dvrk simulate`` with arguments; it ends with the test."""
    with ExitStack() as running:

        def start(*arguments: str) -> StandInProcess:
            log = tmp_path / "stand_in.log"
            return running.enter_context(StandInProcess(ros_master, arguments, log))

        yield start
