"""A laboratory as the executive's world: set-up, registration, stream and cameras put together."""

from __future__ import annotations

from pathlib import Path

from defras_bt.dvrk.camera_source import CameraSource, NoCameras
from defras_bt.dvrk.cameras.ros1_cameras import Ros1Cameras
from defras_bt.dvrk.registering.registration import Registration, read_registration
from defras_bt.dvrk.settings import Ros1Transport, Setup
from defras_bt.dvrk.streaming.servo_process import ServoProcess
from defras_bt.dvrk.transport.ros1_node import join
from defras_bt.dvrk.world import DvrkWorld
from defras_bt.recording.run_file import STREAM_FILE
from defras_sim.scene import Scene


class NotRegistered(ValueError):
    """Something of the set-up, or the patient, was not registered; the message says what to do."""


def registered(setup: Setup, scene: Scene) -> Registration:
    """The registration of ``setup`` for ``scene``.

    Raises:
        NotRegistered: there is none, or not of everything that the set-up uses.
        InvalidFile: it cannot be read.
    """
    file = setup.registration
    if not file.is_file():
        raise NotRegistered(
            f"{file} does not exist: register arms and cameras first (defras dvrk register)"
        )
    found = read_registration(file)
    cameras = {"depth": setup.cameras.depth, "endoscope": setup.cameras.endoscope}
    missing: list[str] = [name for name in setup.arms if name not in found.arms]
    missing += [
        name for name, camera in cameras.items() if camera is not None and name not in found.cameras
    ]
    if missing:
        raise NotRegistered(
            f"{file} says nothing of {' and '.join(missing)}: defras dvrk register {missing[0]}"
        )
    if found.scene != scene.name:
        raise NotRegistered(
            f"{file} was measured for the scene {found.scene!r}, not for {scene.name!r}: tissue "
            "lies elsewhere by now; register anew, or set scene: there if it does not"
        )
    return found


def at_robot_speed(scene: Scene, setup: Setup) -> Scene:
    """``scene`` with arms that reach no faster than the set-up allows."""
    motion = scene.motion
    slowest_m_s = min(motion.reach_speed_m_s, setup.stream.reach_speed_m_s)
    slowed = motion.model_copy(update={"reach_speed_m_s": slowest_m_s})
    return scene.model_copy(update={"motion": slowed})


def open_cameras(setup: Setup, registration: Registration, scene: Scene) -> CameraSource:
    """The cameras of ``setup``; over ROS 1 this process becomes a node.

    Raises:
        RosMissing: ROS is not installed.
        ConnectionFailed: no master answers.
    """
    cameras = setup.cameras
    if cameras.depth is None and cameras.endoscope is None:
        return NoCameras()
    master = setup.transport if isinstance(setup.transport, Ros1Transport) else Ros1Transport()
    join(master, "defras_cameras")
    tissue_from = {name: placed.pose for name, placed in registration.cameras.items()}
    return Ros1Cameras(cameras, tissue_from, scene)


def open_world(setup: Setup, scene: Scene, out: Path | None = None) -> DvrkWorld:
    """Connect to everything. ``out``: the folder for the log of set-points.

    Raises:
        NotRegistered: arms or cameras are not registered.
        RosMissing: ROS is not installed.
        ConnectionFailed: somebody does not answer.
    """
    setup = setup.used_by(scene.arms)
    registration = registered(setup, scene)
    cameras = open_cameras(setup, registration, scene)
    try:
        servo = ServoProcess(setup, None if out is None else out / STREAM_FILE)
    except BaseException:
        cameras.close()
        raise
    try:
        return DvrkWorld(
            setup,
            scene,
            {name: placed.pose for name, placed in registration.arms.items()},
            servo,
            cameras,
            simulated_clock=servo.simulated_clock,
        )
    except BaseException:
        servo.close()
        cameras.close()
        raise
