"""The patient and the cameras in a process of their own.

A world's step and its pictures take tens of milliseconds, during which nothing else in the process
gets on. The arms tell it where their tips are, tick by tick, and hear what the tissue does to them.
"""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Mapping
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from defras_bt.dvrk.stand_in.camera_topics import CameraTopics
from defras_bt.dvrk.stand_in.delivery import Delivery
from defras_bt.dvrk.stand_in.fault_topic import take_orders
from defras_bt.dvrk.stand_in.faults import Source
from defras_bt.dvrk.stand_in.menu import Menu
from defras_bt.dvrk.stand_in.order import StandInOrder, WorldName
from defras_bt.dvrk.stand_in.patient import ArmFeedback, Patient, TipTarget, patient_scene
from defras_bt.dvrk.stand_in.ros_node import join
from defras_bt.dvrk.stand_in.witness import Witness, cameras_witness
from defras_sim.geometry import Pose
from defras_sim.scene import Scene
from defras_sim.worlds.error import WorldError
from defras_sim.worlds.protocol import World

NODE = "defras_patient"
_LOADING_S = 120.0


class PatientLost(RuntimeError):
    """The patient's process ended; the message says why."""


@dataclass(frozen=True)
class PatientOrder:
    """What the patient's process starts from; ``tips``: tissue_from_tip of every arm then."""

    stand_in: StandInOrder
    tips: Mapping[str, Pose]


@dataclass(frozen=True)
class Motion:
    """Where the tips are at the end of tick ``tick``, counted from 1."""

    tick: int
    arms: Mapping[str, TipTarget]


@dataclass(frozen=True)
class Felt:
    """What the tissue does to the arms after tick ``tick``; ``error`` says why no more comes."""

    tick: int
    arms: Mapping[str, ArmFeedback]
    error: str = ""


class PatientProcess:
    """The arms' end of the line to the patient."""

    def __init__(self, order: PatientOrder) -> None:
        """Start it, and wait until the tissue lies there.

        Raises:
            PatientLost: it does not come up.
        """
        context = multiprocessing.get_context("spawn")
        self._line, theirs = context.Pipe()
        self._process = context.Process(target=_live, args=(order, theirs), daemon=True)
        self._process.start()
        theirs.close()
        self.tick = -1
        """The last tick that the patient ended."""
        self.felt: Mapping[str, ArmFeedback] = {}
        if not self._line.poll(_LOADING_S):
            self.close()
            raise PatientLost(f"the patient was not ready within {_LOADING_S:g} s")
        self.hear()

    def begin(self, start_s: float) -> None:
        """World time 0 is ``start_s`` of ROS time; it is now.

        Raises:
            PatientLost: the process is gone.
        """
        self._send(start_s)

    def tell(self, motion: Motion) -> None:
        """Let one more tick pass for the patient.

        Raises:
            PatientLost: its process is gone.
        """
        self._send(motion)

    def _send(self, what: Motion | float) -> None:
        try:
            self._line.send(what)
        except OSError as error:
            raise PatientLost(f"the patient's process is gone: {error}") from error

    def hear(self, within_s: float = 0.0) -> bool:
        """Take what has come, waiting for the first of it at most ``within_s``; whether any did.

        Raises:
            PatientLost: its world cannot go on, or its process is gone.
        """
        heard = False
        try:
            while self._line.poll(0.0 if heard else within_s):
                felt: Felt = self._line.recv()
                if felt.error:
                    raise PatientLost(felt.error)
                self.tick, self.felt, heard = felt.tick, felt.arms, True
        except (EOFError, OSError) as error:
            raise PatientLost("the patient's process ended without a word") from error
        return heard

    def close(self) -> None:
        """End the process; it ends by itself when this one does."""
        self._line.close()
        self._process.join(2.0)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()


def _live(order: PatientOrder, line: Connection) -> None:
    """The patient's process."""
    # Ctrl-C is for the process that commands this one; its end of the line then closes.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    rospy: Any = None
    try:
        whole = order.stand_in
        rospy = join(whole.master_uri, NODE, simulated_clock=whole.simulated_clock)
        world_rng, camera_rng, delivery_rng = np.random.default_rng([whole.seed, 2]).spawn(3)
        actual = whole.imperfections.seen_by(whole.actual)
        world = _world(whole.world, patient_scene(actual, whole.world_tick_s), world_rng)
        patient = Patient(world, actual, whole.imperfections, camera_rng)
        patient.start_at(order.tips)
        line.send(Felt(0, patient.feedback()))
        start_s: float = line.recv()
        menu = Menu(whole.faults)
        delay_s = whole.imperfections.transport_delay_s
        delays: dict[Source, float] = {"cloud": delay_s, "endoscope": delay_s}
        delivery = Delivery(menu, delivery_rng, start_s, delays)
        witness = Witness(cameras_witness(whole.witness))
        cameras = CameraTopics(rospy, delivery, menu, witness)
        take_orders(rospy, menu, lambda: patient.time_s, lambda _: None)
        while True:
            menu.turns(patient.time_s)
            cameras.publish(patient.pictures(), start_s, patient.time_s)
            delivery.flush(patient.time_s)
            motion: Motion = line.recv()
            line.send(Felt(motion.tick, patient.step(motion.arms)))
    except (EOFError, BrokenPipeError):
        pass  # the arms are gone, and with them the operation
    except WorldError as error:
        line.send(Felt(0, {}, f"the patient's world cannot go on: {error}"))
    finally:
        if rospy is not None:
            rospy.signal_shutdown("the stand-in ends")


def _world(name: WorldName, scene: Scene, rng: np.random.Generator) -> World:
    # Each is loaded only where it is wanted: PyBullet is large, and so is the finite-element model.
    if name == "model":
        from defras_sim.worlds.model_world import ModelWorld

        return ModelWorld(scene, rng)
    from defras_sim.worlds.bullet_world import BulletWorld

    return BulletWorld(scene, rng)
