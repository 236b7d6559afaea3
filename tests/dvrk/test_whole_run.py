"""Everything through a real ROS master, by the commands a laboratory uses.

Check, a run to its goal that a pause of both arms interrupts, a bag of it, its replay and its
reading for diagnosis.
"""

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import sleep

import numpy as np
import pytest

from defras_bt.benchmark.dvrk_fault_judge import LATE_S, moving, read_facts
from defras_bt.benchmark.dvrk_patient import slow_patient, write_scene
from defras_bt.diagnosis.recording_reader import read_recording
from defras_bt.dvrk.registering.registration import read_registration
from defras_bt.dvrk.ros_packages import RosMissing, ros_module
from defras_bt.dvrk.settings import load_setup
from defras_bt.dvrk.stand_in.fault_topic import FAULT_TOPIC
from defras_bt.dvrk.stand_in.ros_master import RosMaster
from defras_bt.dvrk.stand_in.stand_in_process import StandInProcess
from defras_bt.dvrk.topics_of import topics_of
from defras_bt.executive.replay import replay
from defras_bt.planning.plan_file import save_plan
from defras_bt.planning.preparation import prepare
from defras_bt.recording.decision_reader import read_decisions
from defras_sim.scene import Scene, load_scene

_DEFRAS = (
    sys.executable,
    "-c",
    "import sys; from defras_bt.cli.main import main; sys.exit(main())",
)
# Several processes in real time: one that a busy machine starves is asked again.
pytestmark = pytest.mark.flaky(reruns=2)

_PAUSE = """
import json, sys, time
from defras_bt.benchmark.dvrk_fault_judge import moving
from defras_bt.dvrk.ros_packages import ros_module
from defras_bt.dvrk.settings import Ros1Transport
from defras_bt.dvrk.transport.ros1_node import join

master, witness, topic = sys.argv[1:]
rospy, string = join(Ros1Transport(master_uri=master), "trouble"), ros_module("std_msgs.msg").String
orders = rospy.Publisher(topic, string, queue_size=10)
moved, told, line = 0, open(witness), ""
told.seek(0, 2)
while moved < 20:
    line += told.readline()
    if line.endswith("\\n"):
        moved += len(moving([json.loads(line)]))
        line = ""
    else:
        time.sleep(0.01)
for arm in ("psm1", "psm2"):
    orders.publish("{fault: paused, arm: %s, duration_s: 1.0}" % arm)
time.sleep(1.0)
"""
_UNREAD = ("local/measured_cp", "local/setpoint_cp", "measured_cv", "body/measured_cf")


@pytest.fixture
def own_master(tmp_path: Path) -> Iterator[RosMaster]:
    """A master whose clock is simulated, which no other test may meet."""
    try:
        ros_module("rospy")
    except RosMissing as error:
        pytest.skip(str(error))
    with RosMaster(tmp_path / "ros") as master:
        yield master


@pytest.fixture(scope="module")
def scene_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A patient on a coarse mesh with few grasp points: seconds of world time, and of rehearsal."""
    file = tmp_path_factory.mktemp("patient") / "patient.yaml"
    write_scene(slow_patient(), file)
    return file


def defras(master: RosMaster, *arguments: str, code: int = 0) -> str:
    """Run a command of defras to its end; what it said."""
    done = subprocess.run(
        [*_DEFRAS, *arguments],
        env={**master.environment, "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=540,
        check=False,
    )
    said = done.stdout + done.stderr
    assert done.returncode == code, said
    return said


@contextmanager
def recorded(master: RosMaster, bag: Path, setup: Path) -> Iterator[None]:
    """``defras dvrk record`` meanwhile."""
    arguments = ("dvrk", "record", str(bag), "--setup", str(setup))
    unread = [f"/{arm}/{topic}" for arm in ("PSM1", "PSM2") for topic in _UNREAD]
    depth = [f"/depth_camera/{topic}" for topic in ("points", "depth/image", "colour/image")]
    raw = [*depth, "/endoscope/image", *unread]
    without = [word for topic in raw for word in ("--without", topic)]
    recorder = subprocess.Popen([*_DEFRAS, *arguments, *without], env=master.environment)
    try:
        yield
        sleep(0.5)
    finally:
        recorder.terminate()
        recorder.wait(20)


@contextmanager
def pausing_in_motion(master: RosMaster, witness: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A process that pauses both arms for a second as soon as set-points move one.

    A process of its own, because this one may belong to the master of other tests already.
    """
    arguments = (sys.executable, "-c", _PAUSE, master.uri, str(witness), FAULT_TOPIC)
    process = subprocess.Popen(arguments, env=master.environment)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def test_check_pause_and_a_retraction_through_ros(
    own_master: RosMaster, scene_file: Path, tmp_path: Path
):
    scene: Scene = load_scene(scene_file)
    plan, witness, lab = tmp_path / "plan.json", tmp_path / "witness.jsonl", tmp_path / "lab"
    prepared = prepare(scene)
    assert prepared.result is not None
    save_plan(prepared.result, plan)
    arguments = (
        str(scene_file), "--world", "model", "--imperfections", "none", "--clock", "simulated",
        "--set-up", str(lab), "--witness", str(witness),
    )  # fmt: skip
    setup, bag, out = lab / "dvrk.yaml", tmp_path / "run.bag", tmp_path / "run"
    on_robot = (str(scene_file), "--setup", str(setup))
    with StandInProcess(own_master, arguments, tmp_path / "stand_in.log"):
        said = defras(own_master, "dvrk", "check", *on_robot, "--approve")
        assert "The check passed." in said
        with recorded(own_master, bag, setup), pausing_in_motion(own_master, witness) as pause:
            run = ("run", *on_robot, "--world", "dvrk", "--plan", str(plan), "--out", str(out))
            said = defras(own_master, *run)
            assert pause.wait(10) == 0
    numbers = json.loads((out / "run.json").read_text())
    assert numbers["outcome"] == "goal", said
    assert numbers["roi_visibility"] >= 0.8
    assert numbers["stream"]["period"]["count"] > 100

    require_still_while_paused(witness)
    assert "PAUSED" in explained(out)
    require_same_decisions(bag, out)
    require_same_readings(bag, out, scene, setup)


def require_still_while_paused(witness: Path) -> None:
    """While both arms were paused, nothing was streamed to them."""
    begun, ended = (
        [
            t["time_s"]
            for t in read_facts(witness)
            if t["event"] == "fault" and t["begins"] is begins
        ]
        for begins in (True, False)
    )
    assert len(begun) == len(ended) == 2
    between = [t for t in moving(read_facts(witness)) if min(begun) + LATE_S < t < max(ended)]
    assert between == []


def require_same_decisions(bag: Path, out: Path) -> None:
    """From a bag of the topics, every tick is decided as it was."""
    again = replay(bag)
    assert again.difference is None
    assert again.ticks == len(list(read_decisions(out).moments()))


def require_same_readings(bag: Path, out: Path, scene: Scene, setup_file: Path) -> None:
    """A bag of the topics says as much as the recording of where tips and tissue were."""
    setup = load_setup(setup_file)
    topics = topics_of(setup, read_registration(setup.registration))
    from_bag = read_recording(bag, scene, topics)
    own = read_recording(out / "recording.mcap", scene)
    for name, tips in own.measured_m.items():
        there = from_bag.measured_m[name].values
        away = np.linalg.norm(tips.values[:, None] - there[None, ::5], axis=-1).min(axis=1)
        assert away.max() < 0.001
    shapes = [[cloud.points_m.shape for cloud in run.clouds] for run in (from_bag, own)]
    assert shapes[0] == shapes[1], (from_bag.quality, own.quality)


def explained(out: Path) -> str:
    """Everything that the run said of its events."""
    events = (event for moment in read_decisions(out).moments() for event in moment.events)
    return " ".join(event.sentence for event in events)
