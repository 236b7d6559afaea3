"""The socket: what a front end sends and gets, also when it sends nonsense or leaves."""

from __future__ import annotations

import json
import socket
import stat
from collections.abc import Iterator
from pathlib import Path
from threading import Thread

import pytest

from defras_bt.executive.operator_desk import OperatorDesk
from defras_bt.executive.operator_socket import (
    ADDRESS_FILE,
    LINE_BYTES,
    NobodyThere,
    ask,
    serve,
    watch,
)
from defras_bt.executive.testing import plan_of
from defras_bt.recording.operator_state import Act, Mode


@pytest.fixture
def desk() -> OperatorDesk:
    return OperatorDesk(asks=True)


@pytest.fixture
def served(desk: OperatorDesk, tmp_path: Path) -> Iterator[Path]:
    with serve(desk, tmp_path):
        yield tmp_path


def raw(folder: Path, *lines: bytes) -> list[dict]:
    """Replies to lines as they are."""
    path = json.loads((folder / ADDRESS_FILE).read_text())["socket"]
    with socket.socket(socket.AF_UNIX) as link:
        link.settimeout(10.0)
        link.connect(path)
        with link.makefile("rwb") as stream:
            replies = []
            for line in lines:
                stream.write(line + b"\n")
                stream.flush()
                replies.append(json.loads(stream.readline()))
            return replies


def test_an_act_takes_effect_and_is_kept_with_its_words(desk: OperatorDesk, served: Path) -> None:
    reply = ask(served, {"act": "take-over", "words": "let me see"})
    assert (reply["ok"], reply["mode"]) == (True, "taken_over")
    assert reply["possible"] == ["hand_back", "stop"]
    state = desk.state()
    assert state.mode is Mode.TAKEN_OVER
    (done,) = state.acts
    assert (done.act, done.source, done.words) == (Act.TAKE_OVER, "socket", "let me see")


def test_what_is_not_possible_is_refused_with_what_is(served: Path) -> None:
    reply = ask(served, {"act": "resume"})
    assert not reply["ok"]
    assert "possible now: pause, take over, stop" in reply["sentence"]


def test_a_plan_is_read_and_answered(desk: OperatorDesk, served: Path) -> None:
    plan = plan_of((2, 4))
    desk.state()
    assert desk.approve(plan) is None
    shown = ask(served, {"act": "status"})
    assert "pulls the tissue up" in shown["question"]
    assert not ask(served, {"act": "approve", "plan": shown["plan"] + 1})["ok"]
    assert ask(served, {"act": "approve", "plan": shown["plan"]})["ok"]
    desk.state()
    assert desk.approve(plan) is True


def test_whoever_watches_hears_of_every_change(desk: OperatorDesk, served: Path) -> None:
    notices = watch(served)
    assert next(notices)["mode"] == "autonomous"
    desk.request(Act.PAUSE, "test")
    assert next(notices)["mode"] == "paused"
    notices.close()


@pytest.mark.parametrize(
    ("line", "says"),
    [
        (b"pause", "Invalid JSON"),
        (b"[]", "object"),
        (b"{}", "act: Field required"),
        (b'{"act": "paus"}', "did you mean pause or status?"),
        (b'{"act": 1}', "act: Input should be a valid string"),
        (b'{"act": "pause", "wrods": ""}', "wrods"),
        (b'{"act": "pause", "plan": "2"}', "plan: Input should be a valid integer"),
        (b"\xff\xfe", "line"),
        (b'{"act": "' + b"x" * LINE_BYTES + b'"}', "at most 4096 bytes"),
    ],
)
def test_nonsense_is_answered_with_what_is_valid(
    desk: OperatorDesk, served: Path, line: bytes, says: str
) -> None:
    (reply,) = raw(served, line)
    assert not reply["ok"]
    assert says in reply["sentence"]
    assert desk.state().acts == ()


def test_after_nonsense_the_connection_still_works(served: Path) -> None:
    _, reply = raw(served, b"what?", b'{"act": "pause"}')
    assert reply["mode"] == "paused"


def test_only_its_user_can_open_it(served: Path) -> None:
    path = Path(json.loads((served / ADDRESS_FILE).read_text())["socket"])
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700


def test_a_folder_with_a_long_name_works_too(desk: OperatorDesk, tmp_path: Path) -> None:
    folder = tmp_path / ("deep" * 30)
    folder.mkdir()
    with serve(desk, folder):
        assert ask(folder, {"act": "status"})["ok"]


def test_afterwards_nothing_is_left(desk: OperatorDesk, tmp_path: Path) -> None:
    with serve(desk, tmp_path) as path:
        pass
    assert list(tmp_path.iterdir()) == []
    assert not path.parent.exists()
    with pytest.raises(NobodyThere, match="no run listens"):
        ask(tmp_path, {"act": "status"})


def test_whoever_watches_is_told_of_the_end(desk: OperatorDesk, tmp_path: Path) -> None:
    with serve(desk, tmp_path):
        notices = watch(tmp_path)
        next(notices)
    assert list(notices) == []


def test_two_runs_do_not_share_a_folder(desk: OperatorDesk, served: Path) -> None:
    with pytest.raises(ConnectionError, match="another run is under way"), serve(desk, served):
        pass
    assert ask(served, {"act": "status"})["ok"], "the first one goes on"


def test_what_a_killed_run_left_is_no_hindrance(desk: OperatorDesk, tmp_path: Path) -> None:
    (tmp_path / ADDRESS_FILE).write_text('{"socket": "/nowhere/operator.sock"}')
    with serve(desk, tmp_path):
        assert ask(tmp_path, {"act": "status"})["ok"]


def test_several_front_ends_at_once(desk: OperatorDesk, served: Path) -> None:
    threads = [
        Thread(target=lambda: raw(served, *[b'{"act": "pause"}', b'{"act": "resume"}'] * 20))
        for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=20.0)
    acts = [done.act for done in desk.state().acts]
    assert acts == ([Act.PAUSE, Act.RESUME] * len(acts))[: len(acts)]
