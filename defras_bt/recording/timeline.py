"""``run.rrd``: the whole run on a rerun timeline."""

from __future__ import annotations

import hashlib
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from defras_bt.recording.drain import Drain
from defras_bt.recording.record import RunInfo, RunSummary, TickRecord
from defras_bt.recording.story import outcome_sentence, plan_markdown
from defras_bt.recording.timeline_blueprint import APPLICATION, default_blueprint
from defras_bt.recording.timeline_changes import Changes
from defras_bt.recording.timeline_field import Field
from defras_bt.recording.timeline_lanes import Lanes
from defras_bt.recording.timeline_signals import log_limits, log_series, log_signals

# So many ticks share a chunk of the file: each costs a kilobyte of its own.
_FLUSH_EVERY = 20
_LEVELS = {
    "info": rr.TextLogLevel.INFO,
    "warning": rr.TextLogLevel.WARN,
    "error": rr.TextLogLevel.ERROR,
}


class TimelineRecorder:
    """Writes ``path``; a killed process loses at most its last second of world time, and what was
    on its way to the disk in the milliseconds before.

    Two runs that are equal tick by tick give recordings that compare equal: no batching by time or
    size, no log time, an id derived from what was run, nothing that depends on the wall clock.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._stream: rr.RecordingStream | None = None
        self._drain: Drain | None = None
        self._info: RunInfo | None = None
        self._lanes: Lanes | None = None
        self._field: Field | None = None
        self._changes = Changes()

    def start(self, info: RunInfo) -> None:
        drain = self._drain = Drain(self._path)
        stream = rr.RecordingStream(
            APPLICATION,
            recording_id=_recording_id(info),
            batcher_config=rr.ChunkBatcherConfig.NEVER(),
            # Properties would hold the time of day.
            send_properties=False,
        )
        stream.set_log_time_enabled(False)
        stream.save(drain.inlet, default_blueprint=_layout(info, pictures=False))
        self._stream, self._info = stream, info
        _set_time(stream, 0, 0.0)
        log_series(stream)
        self._lanes, self._field = Lanes(stream, info), Field(stream, info)
        stream.flush()
        drain.check()

    def tick(self, record: TickRecord) -> None:
        if not (self._stream and self._drain and self._info and self._lanes and self._field):
            raise RuntimeError("a tick came before the start of the run: call start first")
        stream = self._stream
        _set_time(stream, record.tick, record.time_s)
        log_signals(stream, record, self._info)
        self._lanes.tick(record)
        self._field.tick(record)
        pictures = record.observation.endoscope_image is not None
        if pictures and self._changes.new("pictures", True):
            stream.send_blueprint(_layout(self._info, pictures=True))
        if self._changes.new("plan", (record.plan, record.plan_step)):
            told = plan_markdown(record.plan, record.plan_step)
            stream.log("plan", rr.TextDocument(told, media_type="text/markdown"))
        for event in record.events:
            told = "\n".join([event.sentence, *event.data.get("chain", ())])
            entry = rr.TextLog(told, level=_LEVELS[event.level])
            stream.log(f"log/{event.kind}", entry)
        if any(event.level == "error" for event in record.events):
            stream.flush()
            self._drain.check()
        elif record.tick % _FLUSH_EVERY == 0:
            # Nobody waits for the disk; what became of it is asked half a second later.
            stream.flush(timeout_sec=0.0)
        elif record.tick % _FLUSH_EVERY == _FLUSH_EVERY // 2:
            self._drain.check()

    def finish(self, summary: RunSummary) -> None:
        if self._stream is None or self._drain is None or self._info is None:
            return
        outcome = summary.values.get("outcome")
        if outcome is not None:
            level = rr.TextLogLevel.INFO if outcome == "goal" else rr.TextLogLevel.ERROR
            self._stream.log("log/outcome", rr.TextLog(outcome_sentence(summary), level=level))
        log_limits(self._stream, self._info)
        self._stream.flush()
        self._stream.disconnect()
        self._drain.close()


def _set_time(stream: rr.RecordingStream, tick: int, time_s: float) -> None:
    stream.set_time("tick", sequence=tick)
    stream.set_time("sim_time", duration=time_s)


def _recording_id(info: RunInfo) -> str:
    """The same run has the same id; recordings with one id would be merged in the viewer."""
    what = (info.scene_file, info.actual_file, info.world, info.tree, info.seed)
    return hashlib.sha256(repr(what).encode()).hexdigest()[:32]


def _layout(info: RunInfo, *, pictures: bool) -> rrb.Blueprint:
    return default_blueprint(truth_known=info.actual is not None, pictures=pictures)
