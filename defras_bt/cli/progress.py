"""Long work on a terminal: sentences and a bar that counts, on standard error."""

from __future__ import annotations

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn


def sentences() -> Console:
    """Standard error for sentences as they are: not broken, not coloured."""
    return Console(stderr=True, soft_wrap=True, highlight=False)


def counting(console: Console, *, transient: bool = False) -> Progress:
    """A bar with what is done, how much of it, and the time left; nothing off a terminal."""
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=console,
        transient=transient,
        disable=not console.is_terminal,
    )
