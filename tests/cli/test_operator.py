"""The operator at the terminal: keys, piped answers, Ctrl-C, and another terminal."""

from __future__ import annotations

import io
import json
import os
import pty
import signal
import time
from collections.abc import Callable
from pathlib import Path
from threading import Thread

import pytest
from rich.console import Console

from defras_bt.cli.at_the_desk import at_the_desk
from defras_bt.cli.interrupts import Interrupts
from defras_bt.cli.keyboard import KEYS, act_of, listening
from defras_bt.executive.operator_desk import OperatorDesk
from defras_bt.executive.operator_socket import ask, serve
from defras_bt.executive.testing import plan_of
from defras_bt.recording.operator_state import Act, Mode
from defras_bt.recording.record import RunSummary
from defras_bt.recording.summary import SummaryRecorder
from tests.cli.test_outside_world import quick_scene

Defras = Callable[..., tuple[int, str, str]]


def eventually(condition: Callable[[], bool]) -> bool:
    for _ in range(500):
        if condition():
            return True
        time.sleep(0.01)
    return False


@pytest.mark.parametrize(
    ("typed", "act"),
    [
        *KEYS.items(),
        ("P", Act.PAUSE),
        ("take over\n", Act.TAKE_OVER),
        ("hand-back", Act.HAND_BACK),
        ("x", None),
        ("", None),
    ],
)
def test_keys_and_words(typed: str, act: Act | None) -> None:
    assert act_of(typed) is act


def test_a_terminal_gives_single_keys_and_is_left_as_it_was() -> None:
    import termios

    ours, theirs = pty.openpty()
    before = termios.tcgetattr(theirs)
    typed: list[str] = []
    with os.fdopen(theirs, "r") as terminal:
        with listening(typed.append, lambda: None, terminal):
            assert eventually(lambda: not termios.tcgetattr(terminal)[3] & termios.ICANON)
            os.write(ours, b"pr")
            assert eventually(lambda: typed == ["p", "r"])
        assert termios.tcgetattr(terminal) == before
    os.close(ours)


@pytest.fixture
def piped(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    return lambda text: monkeypatch.setattr("sys.stdin", io.StringIO(text))


def answers(desk: OperatorDesk, ticks: int = 500) -> bool | None:
    """What becomes of a plan, asked for tick by tick."""
    plan = plan_of((2, 4))
    for _ in range(ticks):
        desk.state()
        answer = desk.approve(plan)
        if answer is not None:
            return answer
        time.sleep(0.01)
    return None


@pytest.mark.parametrize(("text", "expected"), [("y\n", True), ("n\n", False), ("", False)])
def test_piped_answers(piped: Callable[[str], None], text: str, expected: bool) -> None:
    """They may come before the question. No answer is no approval."""
    piped(text)
    desk, said = OperatorDesk(asks=True), io.StringIO()
    with at_the_desk(desk, Console(file=said), None, asks=True):
        assert answers(desk) is expected
    assert "Carry out this plan?" in said.getvalue()


def test_where_a_socket_listens_a_plan_waits_for_it(
    piped: Callable[[str], None], tmp_path: Path
) -> None:
    piped("")
    desk, said = OperatorDesk(asks=True), io.StringIO()
    with at_the_desk(desk, Console(file=said, soft_wrap=True), tmp_path, asks=True):
        assert answers(desk, ticks=20) is None
    assert f"defras operator {tmp_path} approve" in said.getvalue()


def test_the_first_interrupt_stops_and_the_second_ends_the_program() -> None:
    desk = OperatorDesk()
    before = signal.getsignal(signal.SIGINT)
    with Interrupts(desk).heeded():
        os.kill(os.getpid(), signal.SIGINT)
        state = desk.state()
        assert (state.mode, state.acts[0].source) == (Mode.STOPPED, "Ctrl-C")
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is before


class TestCommand:
    """``defras operator``."""

    def test_an_act(self, defras: Defras, tmp_path: Path) -> None:
        desk = OperatorDesk()
        with serve(desk, tmp_path):
            code, out, _ = defras("operator", str(tmp_path), "take-over", "--say", "let me see")
        assert code == 0
        assert "taken over: From the next tick on: take over." in out
        assert "Possible now: hand-back, stop" in out
        assert desk.state().acts[0].words == "let me see"

    def test_what_is_not_possible(self, defras: Defras, tmp_path: Path) -> None:
        with serve(OperatorDesk(), tmp_path):
            code, out, _ = defras("operator", str(tmp_path), "hand-back")
        assert code == 2
        assert "hand back is not possible" in out

    def test_nobody_there(self, defras: Defras, tmp_path: Path) -> None:
        code, _, err = defras("operator", str(tmp_path), "pause")
        assert code == 2
        assert "no run listens" in err

    def test_the_panel_shows_changes_until_the_run_ends(
        self, defras: Defras, tmp_path: Path, piped: Callable[[str], None]
    ) -> None:
        piped("pause\nbogus\nresume\n")
        desk = OperatorDesk()
        context = serve(desk, tmp_path)
        context.__enter__()
        acts: list[Act] = []

        def leave() -> None:
            eventually(lambda: acts.extend(d.act for d in desk.state().acts) or len(acts) == 2)
            context.__exit__(None, None, None)

        ending = Thread(target=leave)
        ending.start()
        code, out, _ = defras("operator", str(tmp_path))
        ending.join()
        assert code == 0
        assert acts == [Act.PAUSE, Act.RESUME]
        assert "'bogus' is no key" in out


def test_a_run_that_is_paused_and_stopped_keeps_the_acts(
    defras: Defras, tmp_path: Path, piped: Callable[[str], None]
) -> None:
    piped("pause\nresume\nstop\ny\n")
    scene, out = quick_scene(tmp_path, "quick"), tmp_path / "out"
    code, said, _ = defras("run", scene, "--tree", "fras", "--approve", "--out", str(out))
    assert code == 4
    run = json.loads((out / "run.json").read_text())
    assert run["outcome"] == "human"
    assert run["reason"]["code"] == "stopped"
    assert [act["act"] for act in run["operator"]["acts"]] == ["pause", "resume", "stop"]
    assert "The operator paused the operation" in said
    assert "The operator paused the operation" in (out / "report.html").read_text()


def test_a_key_that_bounces_approves_no_plan_that_nobody_has_read() -> None:
    """The second key comes when no plan waits; the next plan is another one."""
    ours, theirs = pty.openpty()
    desk, said = OperatorDesk(asks=True), io.StringIO()
    first, second = plan_of((2, 4)), plan_of((2, 5))
    with os.fdopen(theirs, "r") as terminal, pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.stdin", terminal)
        with at_the_desk(desk, Console(file=said), None, asks=True):
            assert desk.approve(first) is None
            os.write(ours, b"yy")
            assert eventually(lambda: "no plan waits for approval" in said.getvalue())
            desk.state()
            assert desk.approve(first) is True
            desk.state()
            assert desk.approve(second) is None
            assert desk.approve(second) is None
            os.write(ours, b"y")
            assert eventually(lambda: desk.approve(second) is True)
    os.close(ours)


@pytest.mark.parametrize("asks", [True, False])
def test_without_any_input_a_plan_that_must_be_approved_is_refused(
    monkeypatch: pytest.MonkeyPatch, asks: bool
) -> None:
    monkeypatch.setattr("sys.stdin", None)
    desk = OperatorDesk(asks=asks)
    with at_the_desk(desk, Console(quiet=True), None, asks=asks):
        assert answers(desk) is not asks


def test_while_recordings_are_finished_the_desk_is_closed(
    defras: Defras, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replies: list[dict[str, object]] = []

    def finish(self: SummaryRecorder, summary: RunSummary) -> None:
        if not replies:
            replies.append(ask(out, {"act": "pause"}))

    monkeypatch.setattr(SummaryRecorder, "finish", finish)
    scene, out = quick_scene(tmp_path, "quick"), tmp_path / "out"
    defras("run", scene, "--tree", "fras", "--max-time", "1", "--out", str(out))
    assert [(reply["ok"], reply["sentence"]) for reply in replies] == [
        (False, "pause is not possible: the operation has ended")
    ]
