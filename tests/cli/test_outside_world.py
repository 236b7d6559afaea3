"""What surrounds a command: folders, plan files, a silent operator, the installation."""

from __future__ import annotations

import io
import signal
import sys
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from types import ModuleType

import pytest

from defras_bt.cli import plan as plan_command
from defras_bt.cli import run as run_command
from defras_bt.cli.errors import UserError
from defras_bt.cli.main import main
from defras_bt.planning.preparation import Preparation
from defras_bt.recording.run_file import STREAM_FILE
from defras_sim.scene import Scene, load_scene

Defras = Callable[..., tuple[int, str, str]]

# Coarse, with a threshold, so that nothing is rehearsed: {extra} is laid over it.
QUICK = """\
name: quick
thresholds: {{force_n: 1.5}}
tissue: {{elements_xyz: [4, 4, 1]}}
simulation: {{elements_xyz: [4, 4, 1]}}
attachments: {{map: [{rows}]}}
roi: {{center_x_m: 0.0, center_y_m: 0.0}}
{extra}
"""


def quick_scene(folder: Path, name: str, extra: str = "") -> str:
    file = folder / f"{name}.yaml"
    rows = ", ".join(['"........####"'] * 12)
    file.write_text(QUICK.format(rows=rows, extra=extra))
    return str(file)


@pytest.fixture
def nothing_is_rehearsed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wrong arguments have to be noticed before minutes of rehearsals."""

    def rehearse(*_: object, **__: object) -> None:
        raise AssertionError("rehearsed before all arguments were checked")

    monkeypatch.setattr(plan_command, "prepare", rehearse)


@pytest.mark.usefixtures("nothing_is_rehearsed")
@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "demo", "--out", "FILE"),
        ("run", "demo", "--out", "FILE/inside"),
        ("plan", "demo", "--out", "FILE/plan.json"),
        ("plan", "demo", "--out", "FOLDER"),
        ("scene", "show", "demo", "--out", "FOLDER"),
        ("scene", "new", "--seed", "1", "--out", "FILE"),
    ],
)
def test_a_place_that_cannot_be_used(
    defras: Defras, tmp_path: Path, arguments: tuple[str, ...]
) -> None:
    file = tmp_path / "file"
    file.write_text("")
    given = [a.replace("FILE", str(file)).replace("FOLDER", str(tmp_path)) for a in arguments]
    code, _, err = defras(*given)
    assert code == 2
    assert given[-1].removesuffix("/plan.json") in err.replace("\n", "")


def test_the_version_is_told(defras: Defras) -> None:
    code, out, _ = defras("--version")
    assert code == 0
    assert out == f"defras {version('defras')}\n"


@pytest.mark.usefixtures("nothing_is_rehearsed")
def test_what_an_earlier_run_left_is_not_lost(defras: Defras, tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "notes.txt").write_text("mine")
    (out / "recording.mcap").write_text("an hour of measuring")
    code, _, err = defras("run", "demo", "--out", str(out))
    assert code == 2
    assert "an earlier run left recording.mcap there" in err.replace("\n", " ")
    assert (out / "recording.mcap").read_text() == "an hour of measuring"


def test_what_an_earlier_run_left_can_be_given_up(defras: Defras, tmp_path: Path) -> None:
    scene, out = quick_scene(tmp_path, "quick"), tmp_path / "out"
    out.mkdir()
    for name in run_command.LEFT:
        (out / name).write_text("old")
    arguments = ("run", scene, "--tree", "fras", "--max-time", "1", "--out", str(out))
    assert defras(*arguments)[0] == 2
    defras(*arguments, "--replace")
    assert all((out / name).read_bytes()[:3] != b"old" for name in run_command.LEFT)


def test_nothing_is_given_up_for_a_robot_that_does_not_answer(
    defras: Defras, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, out = quick_scene(tmp_path, "quick"), tmp_path / "out"
    out.mkdir()
    names = (*run_command.LEFT, STREAM_FILE)
    for name in names:
        (out / name).write_text("old")

    def silent(*_: object) -> None:
        raise UserError("--world dvrk: no ROS 1 master answers")

    monkeypatch.setattr(run_command, "checked_laboratory", lambda *_: "lab")
    monkeypatch.setattr(run_command, "slowed", lambda believed, _: believed)
    monkeypatch.setattr(run_command, "connected", silent)
    arguments = ("run", scene, "--tree", "fras", "--world", "dvrk", "--out", str(out))
    code, _, err = defras(*arguments)
    assert code == 2
    assert "report.html, stream.csv there" in err.replace("\n", " ")
    code, _, err = defras(*arguments, "--replace")
    assert code == 2
    assert "no ROS 1 master answers" in err
    assert all((out / name).read_text() == "old" for name in names)


def test_a_plan_is_of_the_patient_and_not_of_a_robot_s_speed(
    defras: Defras, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Planned by a command that knows no robot, it holds on one whose arms reach more slowly."""
    motion = "motion: {reach_speed_m_s: 0.02}"
    scene, slower = quick_scene(tmp_path, "quick"), quick_scene(tmp_path, "slower", motion)
    operated: list[Scene] = []
    planned: list[Scene] = []

    def rehearsed(believed: Scene, *_: object, **__: object) -> Preparation:
        planned.append(believed)
        return Preparation(1.5, None)

    def silent(_: object, believed: Scene, __: object) -> None:
        operated.append(believed)
        raise UserError("--world dvrk: no ROS 1 master answers")

    monkeypatch.setattr(run_command, "checked_laboratory", lambda *_: "lab")
    monkeypatch.setattr(run_command, "slowed", lambda *_: load_scene(Path(slower)))
    monkeypatch.setattr(run_command, "rehearsed", rehearsed)
    monkeypatch.setattr(run_command, "connected", silent)
    assert defras("run", scene, "--world", "dvrk")[0] == 2
    assert planned == [load_scene(Path(scene))]
    assert operated == [load_scene(Path(slower))]


@pytest.mark.parametrize("content", [b"\xff\xfe\x00", b"", b"[]", b'{"schema": "other"}'])
def test_a_plan_file_that_is_none(defras: Defras, tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "plan.json"
    file.write_bytes(content)
    code, _, err = defras("run", "demo", "--plan", str(file))
    assert code == 2
    assert "defras/preoperative/1" in err


@pytest.mark.parametrize("place", ["", "nowhere.json"])
def test_a_plan_file_that_cannot_be_read(defras: Defras, tmp_path: Path, place: str) -> None:
    code, _, err = defras("run", "demo", "--plan", str(tmp_path / place))
    assert code == 2
    assert "defras plan -o" in err


@pytest.mark.parametrize(
    ("extra", "says"),
    [
        ("tick_s: 0.1", "tick_s"),
        ('arms: {psm1: {rcm_m: [0, 0.09, 0.2], home_tip_m: [0, 0.07, 0.06], side: "+y"}}', "arms"),
    ],
)
def test_an_actual_scene_of_another_set_up(
    defras: Defras, tmp_path: Path, extra: str, says: str
) -> None:
    believed, actual = quick_scene(tmp_path, "a"), quick_scene(tmp_path, "b", extra)
    code, _, err = defras("run", believed, "--actual", actual, "--tree", "fras")
    assert code == 2
    assert says in err


def test_no_answer_is_no_approval(
    defras: Defras, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO(""))
    scene = quick_scene(tmp_path, "quick")
    code, out, _ = defras("run", scene, "--tree", "fras", "--approve", "--max-time", "5")
    assert code == run_command.OUTCOME_CODES["human"]
    assert "did not approve" in out


def test_doctor_finds_everything_here(defras: Defras) -> None:
    code, out, err = defras("doctor")
    assert (code, err) == (0, "")
    assert "MISSING" not in out


def test_view_wants_a_place_for_the_picture(defras: Defras, tmp_path: Path) -> None:
    (tmp_path / "run.rrd").write_bytes(b"")
    code, _, err = defras("view", str(tmp_path), "--picture", str(tmp_path / "no" / "a.png"))
    assert code == 2
    assert "--picture" in err


def test_an_interrupt_while_loading_leaves_no_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    handlers = []

    class Loading(ModuleType):
        """Stands for the module with all commands, which takes seconds to load."""

        @property
        def run_commands(self) -> Callable[[], None]:
            handlers.append(signal.getsignal(signal.SIGINT))
            return lambda: handlers.append(signal.getsignal(signal.SIGINT))

    monkeypatch.setitem(sys.modules, "defras_bt.cli.app", Loading("app"))
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        main()
    finally:
        signal.signal(signal.SIGINT, before)
    assert handlers == [signal.SIG_DFL, signal.default_int_handler]
