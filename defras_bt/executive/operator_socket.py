"""Front ends outside the program: a Unix socket on which each line is a JSON object.

Requests are ``{"act": "pause", "words": "swab", "plan": 2}`` (words and plan optional; for plan see
``OperatorDesk.request``), ``{"act": "status"}``, and ``{"act": "watch"}``, after which every change
is sent until the client leaves. Each request gets one line, a status:
``{"ok", "sentence", "mode", "question", "plan", "possible"}``.

The socket is a file that only the user who runs the operation can open. It never listens on a
network.
"""

from __future__ import annotations

import json
import os
import shutil
import socket
import socketserver
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from queue import Queue
from tempfile import mkdtemp
from threading import Thread
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError

from defras_bt.executive.operator_desk import DeskNotice, OperatorDesk
from defras_bt.executive.registry import did_you_mean
from defras_bt.recording.operator_state import Act

ADDRESS_FILE = "operator.json"
SCHEMA = "defras/operator/1"
LINE_BYTES = 4096
# Linux allows 107 bytes, other systems fewer.
_PATH_BYTES = 100
_REPLY_TIME_OUT_S = 10.0
_ASKING = ("status", "watch")
_EXAMPLE = '{"act": "pause", "words": "swab"}'


class NobodyThere(ConnectionError):
    """No run listens in this folder."""


@contextmanager
def serve(desk: OperatorDesk, folder: Path) -> Iterator[Path]:
    """Listen for front ends of the run in ``folder``, which gets a file that says where.

    Raises:
        ConnectionError: another run listens there.
    """
    address_file = folder / ADDRESS_FILE
    if address_file.exists() and _answers(folder):
        raise ConnectionError(f"another run is under way in {folder}; give another --out")
    # A folder of our own: the name stays short, and nobody else can get in.
    place = Path(mkdtemp(prefix="defras-"))
    path = place / "operator.sock"
    if len(os.fsencode(path)) > _PATH_BYTES:
        shutil.rmtree(place)
        place = Path(mkdtemp(prefix="defras-", dir="/tmp"))
        path = place / "operator.sock"
    try:
        with _Server(str(path), desk) as server:
            path.chmod(0o600)
            address = {"schema": SCHEMA, "socket": str(path), "pid": os.getpid()}
            address_file.write_text(json.dumps(address) + "\n", encoding="utf-8")
            Thread(target=server.serve_forever, args=(0.1,), daemon=True).start()
            try:
                yield path
            finally:
                server.shutdown()
                server.dismiss()
                address_file.unlink(missing_ok=True)
    finally:
        shutil.rmtree(place, ignore_errors=True)


def ask(folder: Path, request: Mapping[str, Any]) -> dict[str, Any]:
    """Send one request to the run in ``folder``; its reply.

    Raises:
        NobodyThere: no run listens there, or it does not answer.
    """
    with _connected(folder) as line:
        line.write(json.dumps(request).encode() + b"\n")
        line.flush()
        reply = line.readline()
    if not reply:
        raise NobodyThere(f"the run in {folder} ended before it answered")
    return dict(json.loads(reply))


def watch(folder: Path) -> Iterator[dict[str, Any]]:
    """Every notice of the run in ``folder``, beginning with how things are, until it ends.

    Raises:
        NobodyThere: no run listens there.
    """
    with _connected(folder, time_out_s=None) as line:
        line.write(b'{"act": "watch"}\n')
        line.flush()
        for notice in line:
            yield dict(json.loads(notice))


@contextmanager
def _connected(folder: Path, time_out_s: float | None = _REPLY_TIME_OUT_S) -> Iterator[Any]:
    file = folder / ADDRESS_FILE
    try:
        path = json.loads(file.read_text(encoding="utf-8"))["socket"]
        with socket.socket(socket.AF_UNIX) as link:
            link.settimeout(time_out_s)
            link.connect(path)
            with link.makefile("rwb") as line:
                yield line
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise NobodyThere(
            f"no run listens in {folder} ({error}); give the --out folder of a run under way"
        ) from error


def _answers(folder: Path) -> bool:
    try:
        return bool(ask(folder, {"act": "status"}))
    except NobodyThere:
        return False


class _Server(socketserver.ThreadingUnixStreamServer):
    daemon_threads = True
    # A front end that only watches must not keep the program from ending.
    block_on_close = False

    def __init__(self, path: str, desk: OperatorDesk) -> None:
        self.desk = desk
        self.watchers: list[Queue[DeskNotice | None]] = []
        super().__init__(path, _Handler)

    def dismiss(self) -> None:
        """Tell whoever watches that the run is over."""
        for notices in tuple(self.watchers):
            notices.put(None)


class _Handler(socketserver.StreamRequestHandler):
    server: _Server

    def handle(self) -> None:
        desk = self.server.desk
        while line := self.rfile.readline(LINE_BYTES + 1):
            try:
                request = _understood(line)
            except ValueError as error:
                self._send(_status(desk.notice(), False, str(error)))
                if not line.endswith(b"\n"):
                    return  # the rest of an endless line is not read
                continue
            if request.act == "watch":
                self._watch(desk)
                return
            if request.act == "status":
                self._send(_status(desk.notice(), True, "This is how things are."))
                continue
            answer = desk.request(Act(request.act), "socket", request.words, request.plan)
            self._send(_status(desk.notice(), answer.accepted, answer.sentence))

    def _watch(self, desk: OperatorDesk) -> None:
        notices: Queue[DeskNotice | None] = Queue()
        self.server.watchers.append(notices)
        stop = desk.listen(notices.put)
        try:
            self._send(_status(desk.notice(), True, "Watching."))
            while (notice := notices.get()) is not None:
                self._send(_status(notice, True, notice.sentence))
        except OSError:
            return  # the front end has left
        finally:
            stop()
            self.server.watchers.remove(notices)

    def _send(self, status: Mapping[str, Any]) -> None:
        self.wfile.write(json.dumps(status).encode() + b"\n")


class _Request(BaseModel):
    """A request as it should be."""

    model_config = ConfigDict(extra="forbid", strict=True)
    act: str
    words: str = ""
    plan: int | None = None


def _understood(line: bytes) -> _Request:
    """A request that makes sense by itself.

    Raises:
        ValueError: it does not; the message says what would be valid.
    """
    if len(line) > LINE_BYTES:
        raise ValueError(f"a request is one line of at most {LINE_BYTES} bytes")
    try:
        request = _Request.model_validate_json(line)
    except ValidationError as error:
        faults = "; ".join(
            f"{'.'.join(map(str, fault['loc'])) or 'line'}: {fault['msg']}"
            for fault in error.errors()
        )
        raise ValueError(f"{faults}; valid is {_EXAMPLE}") from error
    act = request.act.replace("-", "_")
    acts = [*(member.value for member in Act), *_ASKING]
    if act not in acts:
        raise ValueError(f"there is no act {act!r}{did_you_mean(act, acts)}")
    return request.model_copy(update={"act": act})


def _status(notice: DeskNotice, ok: bool, sentence: str) -> dict[str, Any]:
    return {
        "ok": ok,
        "sentence": sentence,
        "mode": notice.mode.value,
        "question": notice.question,
        "plan": notice.plan_number,
        "possible": [act.value for act in notice.possible],
    }
