"""The robot behind ``--world dvrk``, where a run may have it."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from defras_bt.cli.errors import UserError
from defras_sim.scene import Scene

if TYPE_CHECKING:
    from defras_bt.dvrk.settings import Setup
    from defras_bt.dvrk.world import DvrkWorld
    from defras_bt.recording.record import Recorder


def checked_laboratory(file: Path | None, scene: Scene) -> Setup:
    """The set-up of ``file``, if a fresh check of it has passed for ``scene``.

    Raises:
        UserError: there is none, or no check allows a run.
        InvalidFile: it is not a set-up file.
    """
    # Loaded only where a robot is asked for.
    from defras_bt.dvrk.checking.report import NotChecked, require_checked
    from defras_bt.dvrk.settings import load_setup

    if file is None:
        raise UserError("--world dvrk: give the laboratory's set-up file with --setup")
    setup = load_setup(file)
    missing = [name for name in scene.arms if name not in setup.arms]
    if missing:
        raise UserError(f"--setup {file}: has no {' and no '.join(missing)}, which the scene uses")
    try:
        require_checked(setup, scene, datetime.now(UTC))
    except NotChecked as error:
        raise UserError(f"--world dvrk: {error}") from error
    return setup


def slowed(scene: Scene, setup: Setup) -> Scene:
    """``scene`` at the speed of that robot. Plans are made for ``scene`` itself: how fast arms
    reach changes nothing about them."""
    from defras_bt.dvrk.laboratory import at_robot_speed

    return at_robot_speed(scene, setup)


def connected(setup: Setup, scene: Scene, out: Path | None) -> DvrkWorld:
    """The robot as a world.

    Raises:
        UserError: somebody does not answer, or is not registered.
    """
    from defras_bt.dvrk.laboratory import NotRegistered, open_world
    from defras_bt.dvrk.ros_packages import RosMissing
    from defras_bt.dvrk.streaming.servo_process import ServoLost
    from defras_bt.dvrk.transport.transport import ConnectionFailed

    try:
        return open_world(setup, scene, out)
    except (NotRegistered, RosMissing, ConnectionFailed, ServoLost) as error:
        raise UserError(f"--world dvrk: {error}") from error


def told_to_ros(setup: Setup, robot: DvrkWorld) -> list[Recorder]:
    """What tells a run to the robot's ROS, so that a bag of its topics holds all of it."""
    from defras_bt.dvrk.ros_recorder import RosRecorder

    has_node = setup.transport.kind == "ros1" and setup.cameras.depth is not None
    return [RosRecorder(robot.begin_stamp_s)] if has_node else []
