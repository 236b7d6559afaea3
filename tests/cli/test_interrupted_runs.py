"""Real processes that are interrupted, killed or out of disk: what they leave is readable."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from defras_bt.benchmark.fault_judge import lost_recordings
from defras_bt.cli.interrupts import Interrupts
from defras_bt.cli.run import code_without_record
from defras_bt.executive.operator_desk import OperatorDesk
from defras_bt.recording.bag_reader import read_bag
from defras_bt.recording.summary import read_run_json

QUICK = """\
name: quick
thresholds: {{force_n: 1.5}}
tissue: {{elements_xyz: [4, 4, 1]}}
simulation: {{elements_xyz: [4, 4, 1]}}
attachments: {{map: [{rows}]}}
roi: {{center_x_m: 0.0, center_y_m: 0.0}}
"""
MOST_WAIT_S = 300.0
Start = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """``start(*more)`` runs an operation of a few seconds into ``tmp_path / "out"``."""
    scene = tmp_path / "quick.yaml"
    rows = ", ".join(['"........####"'] * 12)
    scene.write_text(QUICK.format(rows=rows), encoding="utf-8")
    processes = []

    def begin(*more: str, before: Callable[[], None] | None = None) -> subprocess.Popen[str]:
        command = [sys.executable, "-c", "from defras_bt.cli.main import main; main()"]
        arguments = ["run", str(scene), "--tree", "fras", "--out", str(tmp_path / "out"), *more]
        processes.append(
            subprocess.Popen(
                [*command, *arguments],
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                preexec_fn=before,
                env={**os.environ, "PYTHONUNBUFFERED": "1", "COLUMNS": "200"},
            )
        )
        return processes[-1]

    yield begin
    for process in processes:
        process.kill()
        process.communicate()


def wait_for(process: subprocess.Popen[str], sentence: str) -> str:
    """Everything that was printed up to the line with ``sentence``."""
    assert process.stdout is not None
    said = ""
    for line in process.stdout:
        said += line
        if sentence in line:
            return said
    raise AssertionError(f"it never said {sentence!r}: {said}")


def test_after_kill_9_recording_and_timeline_are_readable_up_to_the_last_second(
    start: Start, tmp_path: Path
) -> None:
    process = start()
    wait_for(process, "has reached grasp point")
    process.send_signal(signal.SIGKILL)
    process.wait(MOST_WAIT_S)
    reached_s = 2.8  # world time of that sentence
    assert (
        lost_recordings(tmp_path / "out", {"run.rrd": reached_s, "recording.mcap": reached_s}) == []
    )
    lines = (tmp_path / "out" / "decisions.jsonl").read_text(encoding="utf-8").splitlines()
    assert json.loads(lines[-2])["time_s"] >= reached_s - 0.1


def test_a_second_interrupt_and_any_further_ones_cannot_spoil_the_recordings(
    start: Start, tmp_path: Path
) -> None:
    process = start()
    wait_for(process, "A plan of")
    for _ in range(int(MOST_WAIT_S / 0.05)):
        process.send_signal(signal.SIGINT)
        time.sleep(0.05)
        if process.poll() is not None:
            break
    said, _ = process.communicate(timeout=MOST_WAIT_S)
    assert "Traceback" not in said
    assert process.returncode in (1, 4), said
    out = tmp_path / "out"
    file = read_run_json(out / "run.json")
    assert file.outcome in ("human", "error")
    assert (out / "report.html").stat().st_size > 10_000
    assert list(out.glob("*.part")) == []
    assert (
        lost_recordings(out, {"run.rrd": file.duration_s, "recording.mcap": file.duration_s}) == []
    )


def test_a_disk_that_is_full_ends_no_operation_and_hides_nothing(
    start: Start, tmp_path: Path
) -> None:
    """No file may grow beyond 40 kB: timeline, recording and report break, the run goes on."""
    most = 40 * 1024

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))

    process = start("--max-time", "1.2", before=limit)
    said, _ = process.communicate(timeout=MOST_WAIT_S)
    assert process.returncode == 3, "the outcome counts, not the disk"
    assert "BagRecorder stopped recording at tick" in said
    assert "Not everything was recorded" in said
    out = tmp_path / "out"
    assert read_run_json(out / "run.json").outcome == "not_reached"
    bag = read_bag(out / "recording.mcap")
    assert max(series.time_s.max() for series in bag.series.values()) >= 0.0
    assert list(out.glob("*.part")) == []


def test_a_goal_without_its_record_is_no_success() -> None:
    codes = {outcome: int(code_without_record(outcome)) for outcome in ("goal", "human", "error")}
    assert codes == {"goal": 1, "human": 4, "error": 1}
    assert code_without_record("not_reached") == 3


class TestInterrupts:
    """Handlers alone, in this process."""

    def test_the_first_asks_to_stop_the_second_ends(self) -> None:
        desk = OperatorDesk()
        interrupts = Interrupts(desk)
        before = signal.getsignal(signal.SIGINT)
        with interrupts.heeded():
            assert desk.state().forbids is None
            signal.raise_signal(signal.SIGINT)
            assert desk.state().forbids == "the operator asked to stop"
            with pytest.raises(KeyboardInterrupt):
                signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)  # on the way to finishing
        assert signal.getsignal(signal.SIGINT) is before

    def test_while_finishing_whoever_interrupts_is_asked_to_wait(
        self, capfd: pytest.CaptureFixture[str]
    ) -> None:
        desk = OperatorDesk()
        interrupts = Interrupts(desk)
        with interrupts.heeded(), interrupts.finishing():
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGTERM)
        assert capfd.readouterr().err.count("please wait") == 2
        assert desk.state().forbids is None

    @pytest.mark.parametrize(
        ("number", "said"), [(signal.SIGTERM, "the system"), (signal.SIGHUP, "the terminal")]
    )
    def test_other_ways_to_end_a_program_stop_the_arms_too(self, number, said) -> None:
        desk = OperatorDesk()
        interrupts = Interrupts(desk)
        with interrupts.heeded():
            signal.raise_signal(number)
        assert said in str(desk.state().forbids)

    def test_after_an_interrupted_last_deed_nobody_listens_any_more(self) -> None:
        numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
        before = {number: signal.getsignal(number) for number in numbers}
        try:
            with Interrupts(OperatorDesk(), last_deed=True).heeded():
                signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def test_what_was_ignored_stays_ignored(self) -> None:
        before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
        try:
            desk = OperatorDesk()
            with Interrupts(desk).heeded():
                signal.raise_signal(signal.SIGHUP)
            assert desk.state().forbids is None
        finally:
            signal.signal(signal.SIGHUP, before)
