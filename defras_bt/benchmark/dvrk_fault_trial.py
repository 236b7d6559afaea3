"""One run against the stand-in with one fault, in a process of its own."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from shutil import rmtree
from threading import Event, Thread
from time import monotonic, sleep, time

from defras_bt.benchmark.dvrk_fault_cases import DvrkFault, known_after_s
from defras_bt.benchmark.dvrk_fault_judge import (
    Countdown,
    DvrkVerdict,
    Fact,
    fault_times,
    first_foreign_s,
    first_picture_s,
    grips,
    last_motion_s,
    moving,
    read_facts,
)
from defras_bt.benchmark.dvrk_patient import slow_patient, write_scene
from defras_bt.benchmark.fault_judge import NUMBERS, RECORDING, lost_recordings
from defras_bt.benchmark.own_process import ProcessFailed, in_own_process
from defras_bt.dvrk.laboratory import open_world
from defras_bt.dvrk.ros_packages import ros_module
from defras_bt.dvrk.settings import Setup, load_setup
from defras_bt.dvrk.stand_in.fault_topic import FAULT_TOPIC
from defras_bt.dvrk.stand_in.ros_master import RosMaster
from defras_bt.dvrk.stand_in.set_up import SETUP_FILE
from defras_bt.dvrk.stand_in.stand_in_process import StandInProcess
from defras_bt.dvrk.stand_in.witness import cameras_witness
from defras_bt.executive.executive import ExecutiveFailed
from defras_bt.executive.operation import ROBOT_WORLD, Operation, operate_in, random_generators
from defras_bt.planning.preparation import Preparation
from defras_bt.recording.bag import BagRecorder
from defras_bt.recording.decisions import DECISIONS_FILE, DecisionRecorder
from defras_bt.recording.record import Recorder
from defras_bt.recording.summary import SummaryRecorder
from defras_sim.resources import resource
from defras_sim.scene import Scene, load_scene

LASTS_S = 8.0
"""How long an ordered fault lasts; a run that waits for its end asks for a human before it."""

MAX_TIME_S = 60.0
_RESTART_S = 120.0
_SOUND_WITHIN_S = 10.0
"""So long a new run may wait for an arm or a camera; a run itself waits half of that."""
_SCENE, _WITNESS, _LAB, _LOG = "patient.yaml", "witness.jsonl", "lab", "stand_in.log"


@dataclass(frozen=True)
class Ended:
    """How the executive's run ended; ``broke`` says what nobody caught."""

    outcome: str
    reason: str
    duration_s: float
    broke: str = ""


def trial(fault: DvrkFault, prepared: Preparation, folder: Path) -> DvrkVerdict:
    """Run, let the fault come, judge. ``folder`` must exist and be empty."""
    scene_file = folder / _SCENE
    write_scene(slow_patient(), scene_file)
    scene = load_scene(scene_file)
    with ExitStack() as running:
        master = running.enter_context(RosMaster(folder / "ros"))
        stand_in = running.enter_context(_stand_in(master, folder))
        setup = load_setup(folder / _LAB / SETUP_FILE)
        world = open_world(setup, scene, folder)
        trouble = _Trouble(fault, folder, master, stand_in)
        operation = _operation(scene, prepared, fault.seed)
        recorders: list[Recorder] = [
            BagRecorder(folder / RECORDING),
            DecisionRecorder(folder / DECISIONS_FILE),
            SummaryRecorder(folder / NUMBERS),
        ]
        trouble.start()
        try:
            _, rng = random_generators(fault.seed)
            values = operate_in(world, operation, rng, recorders).values
            said = values.get("reason") or {}
            ended = Ended(values["outcome"], said.get("sentence", ""), values["duration_s"])
        except ExecutiveFailed as error:
            ended = Ended("error", str(error), 0.0, f"{type(error.__cause__).__name__}: {error}")
        trouble.end()
        facts = read_facts(folder / _WITNESS)
        if fault.killed is not None:
            stand_in.kill()
            master.kill()
            running.close()
            fresh = running.enter_context(RosMaster(folder / "ros_again"))
            # The new one is reached elsewhere, and a stand-in writes over no set-up.
            rmtree(folder / _LAB)
            running.enter_context(_stand_in(fresh, folder))
        else:
            _wait_until_over(folder)
        restarts = _restarts(folder)
    return _judged(fault, setup, scene, facts, trouble, ended, restarts, folder)


def _stand_in(master: RosMaster, folder: Path) -> StandInProcess:
    arguments = (
        str(folder / _SCENE), "--world", "model", "--imperfections", "none",
        "--set-up", str(folder / _LAB), "--witness", str(folder / _WITNESS),
    )  # fmt: skip
    return StandInProcess(master, arguments, folder / _LOG)


def _operation(scene: Scene, prepared: Preparation, seed: int) -> Operation:
    return Operation(
        scene=scene,
        actual=None,
        scene_file=_SCENE,
        actual_file=None,
        world=ROBOT_WORLD,
        tree_file=resource("trees/defras.yaml"),
        seed=seed,
        force_threshold_n=prepared.force_threshold_n,
        preoperative=prepared.plan,
        max_time_s=MAX_TIME_S,
    )


class _Trouble:
    """Makes the fault when so many set-points have moved an arm, from a grasp on if it asks so."""

    def __init__(
        self, fault: DvrkFault, folder: Path, master: RosMaster, stand_in: StandInProcess
    ) -> None:
        self._fault, self._witness = fault, folder / _WITNESS
        self._master, self._stand_in = master, stand_in
        self._over = Event()
        self._thread = Thread(target=self._make, daemon=True)
        rospy, string = ros_module("rospy"), ros_module("std_msgs.msg").String
        self._orders = rospy.Publisher(FAULT_TOPIC, string, queue_size=10)
        self._string = string
        self.killed_at_s: float | None = None
        """ROS time at which something was killed."""

    def start(self) -> None:
        # Arms and cameras both take orders.
        while self._orders.get_num_connections() < 2:
            sleep(0.01)
        self._thread.start()

    def end(self) -> None:
        """The run is over: a fault that has not come will not."""
        self._over.set()
        self._thread.join()

    def _make(self) -> None:
        countdown, line = Countdown(self._fault), ""
        with self._witness.open(encoding="utf-8") as told:
            while not self._over.is_set():
                # A line may be met while it is being written.
                line += told.readline()
                if not line.endswith("\n"):
                    sleep(0.002)
                    continue
                fact = json.loads(line)
                line = ""
                if countdown.over(fact):
                    self._strike()
                    return

    def _strike(self) -> None:
        if self._fault.entry is not None:
            entry = {**self._fault.entry, "duration_s": LASTS_S}
            # JSON is YAML.
            self._orders.publish(self._string(data=json.dumps(entry)))
            return
        self.killed_at_s = time()
        if self._fault.killed == "master":
            self._master.kill()
        else:
            self._stand_in.kill()


def _wait_until_over(folder: Path) -> None:
    """Wait for the end of the fault that was ordered, if it came."""
    since_s = monotonic()
    while monotonic() - since_s < LASTS_S + 5.0:
        begun_s, ended_s = fault_times(read_facts(folder / _WITNESS))
        if begun_s == float("inf") or ended_s < float("inf"):
            return
        sleep(0.1)


def _restarts(folder: Path) -> str:
    """What keeps a new run from starting; "" if nothing does."""
    try:
        return in_own_process(_connect_again, folder, within_s=_RESTART_S)
    except ProcessFailed as error:
        return str(error).strip().splitlines()[-1]


def _connect_again(folder: Path) -> str:
    world = open_world(load_setup(folder / _LAB / SETUP_FILE), load_scene(folder / _SCENE))
    try:
        since_s, missing = monotonic(), "nothing was seen"
        while missing and monotonic() - since_s < _SOUND_WITHIN_S:
            world.step()
            seen = world.observe()
            no_cloud = () if seen.cloud is not None else ("no cloud",)
            missing = "; ".join((*seen.stopped.values(), *no_cloud))
        return missing
    finally:
        world.close()


def _judged(
    fault: DvrkFault,
    setup: Setup,
    scene: Scene,
    facts: Sequence[Fact],
    trouble: _Trouble,
    ended: Ended,
    restarts: str,
    folder: Path,
) -> DvrkVerdict:
    begun_s, _ = fault_times(facts)
    if trouble.killed_at_s is not None:
        start_s = next(fact["start_s"] for fact in facts if fact["event"] == "clock")
        begun_s = trouble.killed_at_s - start_s
    after_s = known_after_s(fault, setup.limits, scene.thresholds.max_age_s)
    known_s = None if after_s is None else begun_s + after_s
    if fault.kind in ("millimetres", "wrong_frame", "frozen") and after_s is not None:
        pictures = read_facts(cameras_witness(folder / _WITNESS) or folder)
        known_s = first_picture_s(pictures, fault.kind) + after_s
    if fault.kind == "second_client" and after_s is not None:
        known_s = first_foreign_s(facts) + after_s
    times_s = moving(facts)
    last_s = last_motion_s(times_s, begun_s)
    late_s = 0.0
    if known_s is not None and known_s < float("inf"):
        late_s = max(0.0, (last_motion_s(times_s, known_s) or known_s) - known_s)
    broke = ended.broke
    if not broke and begun_s == float("inf"):
        broke = f"the run ended before the fault came ({ended.reason})"
    elif not broke and known_s == float("inf"):
        broke = "the fault was ordered, and never showed"
    held, let_go = grips(facts, begun_s, begun_s + LASTS_S)
    needed = {RECORDING: ended.duration_s, NUMBERS: ended.duration_s}
    return DvrkVerdict(
        outcome=ended.outcome,
        reason=ended.reason,
        begun_s=begun_s,
        known_s=known_s,
        last_s=last_s,
        late_ms=1e3 * late_s,
        held=held,
        grip_lost=let_go and ended.outcome != "goal",
        lost=tuple(lost_recordings(folder, needed)),
        restarts=restarts,
        broke=broke,
    )
