"""A disk that is really full: /dev/full takes no byte."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest

from defras_bt.recording.bag import BagRecorder
from defras_bt.recording.composite import CompositeRecorder, RecordingFailed
from defras_bt.recording.drain import Drain
from defras_bt.recording.record import Recorder, RunSummary
from defras_bt.recording.timeline import TimelineRecorder
from defras_bt.recording.timeline_digest import timeline_digest
from tests.recording.synthetic_run import SyntheticRun

FULL = Path("/dev/full")
SUMMARY = RunSummary({})

pytestmark = pytest.mark.skipif(not FULL.exists(), reason="this system has no /dev/full")


class TestDrain:
    """Whatever goes in comes out, or is thrown away with an error."""

    def test_what_is_written_arrives_whole(self, tmp_path: Path) -> None:
        content = bytes(range(256)) * 4096
        drain = Drain(tmp_path / "file")
        drain.inlet.write_bytes(content)
        drain.close()
        assert (tmp_path / "file").read_bytes() == content
        assert not drain.inlet.exists()

    def test_nobody_waits_for_a_disk_that_is_full(self) -> None:
        drain = Drain(FULL)
        drain.inlet.write_bytes(b"x" * 1_000_000)
        with pytest.raises(OSError, match="No space left") as caught:
            drain.close()
        assert caught.value.errno == errno.ENOSPC
        with pytest.raises(OSError, match="No space left"):
            drain.check()

    def test_a_file_that_cannot_be_opened_is_told_at_once(self, tmp_path: Path) -> None:
        with pytest.raises(FileNotFoundError):
            Drain(tmp_path / "nowhere" / "file")


@pytest.mark.parametrize("recorder", [TimelineRecorder, BagRecorder])
def test_one_recorder_on_a_full_disk_costs_nothing_of_the_others(
    tmp_path: Path, short_run: SyntheticRun, recorder
) -> None:
    whole, alone = tmp_path / "whole.rrd", tmp_path / "alone.rrd"
    with pytest.raises(RecordingFailed, match="No space left") as caught:
        record(CompositeRecorder([recorder(FULL), TimelineRecorder(whole)]), short_run)
    assert caught.value.summary is SUMMARY
    assert recorder.__name__ in str(caught.value)
    record(TimelineRecorder(alone), short_run)
    assert whole.stat().st_size > 0.9 * alone.stat().st_size
    assert timeline_digest(whole) != timeline_digest(alone), "the fault is told in the log"


def record(recorder: Recorder, run: SyntheticRun) -> None:
    recorder.start(run.info)
    for tick in run.ticks()[:60]:
        recorder.tick(tick)
    recorder.finish(SUMMARY)
