"""What a run says in the terminal while it goes on."""

from __future__ import annotations

import math

from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text

from defras_bt.planning.english import action_sentence
from defras_bt.recording.record import Event, RunInfo, RunSummary, TickRecord
from defras_bt.recording.story import outcome_sentence, percent

# The line is redrawn so often in world time: more would only flicker.
_REDRAW_S = 0.2
_LEVEL_STYLES = {"info": "", "warning": "yellow", "error": "bold red"}
_STATE_STYLES = ("green", "yellow", "dark_orange", "bold red")


class EventPrinter:
    """Prints every event as a sentence with its world time."""

    def __init__(self, console: Console) -> None:
        self._console = console

    def start(self, info: RunInfo) -> None:
        pass

    def tick(self, record: TickRecord) -> None:
        for event in record.events:
            self._console.print(_event_line(event), highlight=False)

    def finish(self, summary: RunSummary) -> None:
        style = "bold green" if summary.values["outcome"] == "goal" else "bold red"
        self._console.print(Text(outcome_sentence(summary), style=style))


class ProgressLine:
    """One live line: time, action, force, discrepancy, warning state, rate, visibility.

    Without a terminal it says nothing; :class:`EventPrinter` then tells the run line by line. Give
    both the same console, so that sentences appear above the line.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._live: Live | None = None
        self._info: RunInfo | None = None
        self._drawn_s = -math.inf

    def start(self, info: RunInfo) -> None:
        self._info = info
        if self._console.is_terminal:
            self._live = Live(console=self._console, auto_refresh=False, transient=True)
            self._live.start()

    def tick(self, record: TickRecord) -> None:
        if self._live is None or self._info is None:
            return
        if record.time_s - self._drawn_s >= _REDRAW_S or record.events:
            self._drawn_s = record.time_s
            self._live.update(progress_line(record, self._info), refresh=True)

    def finish(self, summary: RunSummary) -> None:
        if self._live is not None:
            self._live.stop()
            self._live = None


def progress_line(record: TickRecord, info: RunInfo) -> Table:
    """The state of a run in one row."""
    over = not record.force_n <= info.force_threshold_n  # as guards see it: unknown is over
    force = f"{record.force_n:.2f}" if math.isfinite(record.force_n) else "?"
    seen = record.observation.roi_visibility
    row = Table.grid(padding=(0, 2))
    cells = (
        Text(f"{record.time_s:6.1f} s", style="bold"),
        Text(_action(record)),
        Text(f"F {force}/{info.force_threshold_n:.2f} N", style="bold red" if over else ""),
        *_monitoring(record, info),
        Text(f"rate {percent(record.rate)}", style="" if record.rate == 1 else "yellow"),
        Text(f"region {'?' if seen is None else percent(seen)}", style="cyan"),
    )
    for _ in cells:
        # One line, however narrow the terminal is.
        row.add_column(no_wrap=True, overflow="ellipsis")
    row.add_row(*cells)
    return row


def _action(record: TickRecord) -> str:
    if record.operator.holds:
        return record.operator.mode.value.replace("_", " ").upper()
    if record.plan is None or record.action is None:
        return "no action"
    return f"{record.action.time}/{len(record.plan.actions)} {action_sentence(record.action)}"


def _monitoring(record: TickRecord, info: RunInfo) -> tuple[Text, ...]:
    state = info.warning_state(record.reading)
    if record.reading is None or info.metric is None or state is None:
        return ()
    mu_m = record.reading.mu_m[info.metric]
    said = f"mu {1000 * mu_m:.1f} mm" if math.isfinite(mu_m) else "mu ?"
    return Text(said), Text(f"s={state}", style=_STATE_STYLES[state])


def _event_line(event: Event) -> Text:
    line = Text(f"{event.time_s:7.2f} s  ", style="dim")
    return line.append(event.sentence, style=_LEVEL_STYLES[event.level])
