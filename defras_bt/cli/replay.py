"""``defras replay``: decide everything in a recorded run once more."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from defras_bt.cli.errors import ExitCode, UserError
from defras_bt.cli.files import find
from defras_bt.executive.replay import Difference, Replay
from defras_bt.executive.replay import replay as replay_run
from defras_bt.recording.decision_reader import InvalidDecisions
from defras_bt.recording.explain import explain
from defras_bt.recording.inputs_reader import NoInputs
from defras_bt.recording.moment import Moment

_MOST_PATHS = 8


def replay(
    run: Annotated[Path, typer.Argument(help="Folder that defras run --out left.")],
    tree: Annotated[
        str | None, typer.Option(help="Another tree: what would it have decided?")
    ] = None,
) -> None:
    """Run the executive once more on the recorded readings, without a world.

    Says at which tick it first decides otherwise than it did, and why it did then and does now.
    With the same program, tree and seed it never does. Exit code: 0 nothing differs, 3 something
    does, 2 invalid input.

    Example: defras replay out/demo; defras replay out/demo --tree mine.yaml
    """
    console = Console(soft_wrap=True, highlight=False)
    try:
        result = replay_run(run, find(tree, "trees") if tree is not None else None)
    except (NoInputs, InvalidDecisions) as error:
        raise UserError(str(error)) from error
    for line in _told(result):
        console.print(line, markup=False)
    if result.difference is not None:
        raise typer.Exit(ExitCode.NOT_REACHED)


def _told(result: Replay) -> list[str]:
    if result.difference is not None:
        return _difference(result.difference)
    lines = [f"{result.ticks} ticks decided once more: all as recorded."]
    if result.broke is not None:
        lines.append(f"The recorded run then broke, which cannot be replayed: {result.broke}")
    return lines


def _difference(found: Difference) -> list[str]:
    what = "words" if found.only_words else "status"
    lines = [f"Tick {found.replayed.tick} is the first that differs, in the {what} of:"]
    for path in found.paths[:_MOST_PATHS]:
        lines.append(f"  {path}: {_word(found.recorded, path)}, now {_word(found.replayed, path)}")
    if len(found.paths) > _MOST_PATHS:
        lines.append(f"  and {len(found.paths) - _MOST_PATHS} more")
    return [
        *lines,
        "",
        f"As recorded. {explain(found.recorded).text}",
        "",
        f"Replayed. {explain(found.replayed).text}",
    ]


def _word(moment: Moment, path: str) -> str:
    word = moment.nodes.get(path)
    if word is None:
        return "not there"
    ticked = word.status if word.ticked else f"not ticked (before: {word.status})"
    return f"{ticked} ({word.message})" if word.message else ticked
