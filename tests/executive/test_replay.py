"""A recorded run decided once more: the same, or the first change where something changed."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from defras_bt.executive.executive import ExecutiveFailed
from defras_bt.executive.operation import Operation, operate, operate_in, random_generators
from defras_bt.executive.operator_desk import OperatorDesk
from defras_bt.executive.replay import replay
from defras_bt.executive.scripted import Script
from defras_bt.executive.substitution import Substitute, Substitutes
from defras_bt.faults.faults import FaultInjection, Faults
from defras_bt.faults.readings import Frozen
from defras_bt.faults.system import PlannerTimesOut, TwinDiverges
from defras_bt.recording.bag import BagRecorder
from defras_bt.recording.decision_reader import read_decisions
from defras_bt.recording.decisions import DECISIONS_FILE, DecisionRecorder
from defras_bt.recording.inputs_reader import BAG, NoInputs, read_inputs
from defras_bt.recording.operator_state import Act
from defras_bt.recording.record import Recorder
from defras_sim.resources import resource
from defras_sim.scene import Attachments, Roi, Scene, Simulation, Tissue
from defras_sim.worlds.model_world import ModelWorld

BELIEVED = tuple("........####" if 2 <= row <= 9 else "............" for row in range(12))
ACTUAL = ("...####.....", "...####.....", *BELIEVED[2:])


def scene(rows: tuple[str, ...]) -> Scene:
    return Scene(
        name="slab",
        tissue=Tissue(elements_xyz=(4, 4, 1)),
        attachments=Attachments(map=rows),
        roi=Roi(center_x_m=0.0, center_y_m=0.0),
        simulation=Simulation(elements_xyz=(5, 5, 1)),
    )


def operation(tree: Path, **changes: object) -> Operation:
    plain = Operation(
        scene=scene(BELIEVED),
        actual=scene(ACTUAL),
        scene_file="slab.yaml",
        actual_file=None,
        world="model",
        tree_file=tree,
        seed=3,
        force_threshold_n=0.4,
        max_time_s=4.0,
    )
    return replace(plain, **changes)


def recorders(folder: Path) -> list[Recorder]:
    return [BagRecorder(folder / BAG), DecisionRecorder(folder / DECISIONS_FILE)]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory) -> Path:
    """A run up to the pull with the learning tree, with a script instead of one of its actions."""
    folder = tmp_path_factory.mktemp("run")
    told = Substitute(path="**/act/*_pull_*", **Script(status="FAILURE", after_s=0.4).model_dump())
    slow = Substitutes(((told, (Path("mocks.yaml"), 1, 1)),))
    tree = resource("trees/defras.yaml")
    operate(operation(tree, substitutes=slow, max_time_s=6.0), recorders(folder))
    return folder


@pytest.fixture
def run(recorded, tmp_path) -> Path:
    """A copy that a test may change."""
    return Path(shutil.copytree(recorded, tmp_path / "run"))


class Scripted(OperatorDesk):
    """An operator who does ``acts`` by tick."""

    def __init__(self, acts, *, asks=False):
        super().__init__(asks=asks)
        self._by_tick, self._tick = acts, 0

    def state(self):
        if self._tick in self._by_tick:
            assert self.request(self._by_tick[self._tick], "test").accepted
        self._tick += 1
        return super().state()


class TestUnchanged:
    def test_nothing_differs_not_even_a_word(self, recorded):
        result = replay(recorded)
        assert result.ticks == len(read_inputs(recorded).ticks) > 100
        assert result.difference is None
        assert result.broke is None

    def test_what_the_operator_said_is_part_of_it(self, tmp_path):
        operator = Scripted({12: Act.PAUSE, 20: Act.RESUME, 40: Act.STOP})
        summary = operate(
            operation(resource("trees/fras.yaml")), recorders(tmp_path), operator=operator
        )
        assert summary.values["outcome"] == "human"
        result = replay(tmp_path)
        assert (result.ticks, result.difference) == (41, None)

    def test_a_refused_plan_is_refused_again(self, tmp_path):
        summary = operate(
            operation(resource("trees/fras.yaml")),
            recorders(tmp_path),
            operator=Scripted({9: Act.REFUSE}, asks=True),
        )
        assert summary.values["outcome"] == "human"
        assert replay(tmp_path).difference is None

    def test_a_plan_that_waited_for_approval_waits_again(self, tmp_path):
        summary = operate(
            operation(resource("trees/fras.yaml"), max_time_s=2.0),
            recorders(tmp_path),
            operator=Scripted({9: Act.APPROVE}, asks=True),
        )
        assert [act["act"] for act in summary.values["operator"]["acts"]] == ["approve"]
        result = replay(tmp_path)
        assert (result.ticks > 20, result.difference) == (True, None)

    @pytest.mark.parametrize(
        ("faults", "codes"),
        [
            ([PlannerTimesOut()], {"planner_timed_out"}),
            (
                [
                    Frozen(reading="cloud", start_s=0.5, duration_s=0.7),
                    TwinDiverges(start_s=2.0, duration_s=0.3),
                ],
                {"stale", "force_unknown"},
            ),
        ],
    )
    def test_faults_of_sensors_and_of_the_program_are_part_of_it(self, tmp_path, faults, codes):
        run = operation(resource("trees/fras.yaml"), max_time_s=3.0)
        injected = FaultInjection(Faults(tuple(faults)), run.scene, run.seed)
        operate(run, recorders(tmp_path), faults=injected)
        moments = list(read_decisions(tmp_path).moments())
        assert codes <= {word.code for moment in moments for word in moment.nodes.values()}
        result = replay(tmp_path)
        assert (result.ticks, result.difference) == (len(moments), None)

    def test_a_killed_run_is_replayed_as_far_as_it_was_recorded(self, run):
        file = run / BAG
        file.write_bytes(file.read_bytes()[: file.stat().st_size * 2 // 3])
        result = replay(run)
        assert 20 < result.ticks < 120
        assert result.difference is None

    def test_a_run_that_broke_is_replayed_up_to_there(self, tmp_path):
        world_rng, learning_rng = random_generators(3)
        world = ModelWorld(scene(ACTUAL), world_rng)
        ticks = []

        def step() -> None:
            ticks.append(1)
            if len(ticks) == 15:
                raise RuntimeError("the cable is cut")
            ModelWorld.step(world)

        world.step = step
        with pytest.raises(ExecutiveFailed):
            operate_in(
                world, operation(resource("trees/fras.yaml")), learning_rng, recorders(tmp_path)
            )
        result = replay(tmp_path)
        assert (result.ticks, result.difference) == (15, None)
        assert "the cable is cut" in result.broke


class TestChanged:
    def test_the_first_tick_with_another_status_is_found(self, run):
        path = _change(run, 40, "defras/operate/sensors_fresh", 1, "FAILURE")
        result = replay(run)
        assert result.ticks == 41
        assert result.difference.replayed.tick == result.difference.recorded.tick == 40
        assert result.difference.paths == (path,)
        assert not result.difference.only_words

    def test_other_words_are_told_as_such(self, run):
        path = _change(run, 40, "defras/operate/sensors_fresh", 3, "all is well")
        found = replay(run).difference
        assert (found.recorded.tick, found.paths, found.only_words) == (40, (path,), True)

    def test_another_tree_shows_what_it_would_have_decided(self, recorded, tmp_path):
        shutil.copytree(resource("trees"), tmp_path / "trees")
        tree = tmp_path / "trees" / "defras.yaml"
        text = tree.read_text(encoding="utf-8")
        # Seen from the tree: as little as anybody wants to see is enough.
        changed = text.replace("[SensorsFresh, RegionVisible, Finish]", "[SensorsFresh, GiveUp]")
        assert changed != text
        tree.write_text(changed, encoding="utf-8")
        found = replay(recorded, tree).difference
        assert found.recorded.tick == 0
        assert "defras/goal" in found.paths
        assert "defras/goal/give_up" not in found.paths, "only one of the trees has it"

    def test_the_recorded_tree_counts_whatever_became_of_its_file(self, run, tmp_path):
        tree = read_inputs(run).setup["again"]["tree"]
        assert tree["main"] == "defras.yaml"
        assert "diagnose.yaml" in tree["files"]


class TestRefused:
    def test_a_folder_without_recording(self, tmp_path):
        with pytest.raises(NoInputs, match="give a folder that defras run --out left"):
            replay(tmp_path)


def _change(run: Path, tick: int, node: str, place: int, value: str) -> str:
    """Write into the record of ``tick`` that ``node`` had said otherwise."""
    file = run / DECISIONS_FILE
    lines = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]
    said = next(
        line["nodes"][node] for line in reversed(lines[: tick + 2]) if node in line.get("nodes", {})
    )
    changed = list(said)
    changed[place] = value
    at = lines[tick + 1]
    assert at["tick"] == tick
    at["nodes"] = {**at["nodes"], node: changed}
    lines[tick + 2]["nodes"].setdefault(node, said)
    file.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")
    return node
