"""``defras operator``: pause, resume, stop, take over and hand back a run from another terminal."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from defras_bt.cli.errors import ExitCode, UserError
from defras_bt.cli.keyboard import HELP, act_of, listening
from defras_bt.executive.operator_socket import NobodyThere, ask, watch


class Word(StrEnum):
    """What can be asked on the command line."""

    status = "status"
    pause = "pause"
    resume = "resume"
    stop = "stop"
    take_over = "take-over"
    hand_back = "hand-back"
    approve = "approve"
    refuse = "refuse"


def operator(
    run: Annotated[Path, typer.Argument(help="--out folder of a run under way.")],
    act: Annotated[Word | None, typer.Argument(help="Default: a panel with keys.")] = None,
    say: Annotated[str, typer.Option(help="Words that are kept with the act.")] = "",
    plan: Annotated[int | None, typer.Option(help="Number of the plan that is answered.")] = None,
) -> None:
    """Speak for the operator of a run: once, or with keys until the run ends.

    Exit code: 0 done, 2 not possible (the sentence says what is), or no run listens.

    Example: defras operator out/demo pause --say "swab"; defras operator out/demo
    """
    console = Console(soft_wrap=True, highlight=False)
    try:
        if act is None:
            _panel(run, console)
            return
        reply = ask(run, {"act": act.value, "words": say, "plan": plan})
    except NobodyThere as error:
        raise UserError(str(error)) from error
    _show(reply, console)
    if not reply["ok"]:
        raise typer.Exit(ExitCode.INVALID)


def _panel(run: Path, console: Console) -> None:
    """Show every change, and pass on keys, until the run ends."""
    shown = {"plan": 0}

    def typed(text: str) -> None:
        act = act_of(text)
        if act is None:
            console.print(f"{text.strip()!r} is no key. Keys: {HELP}.", markup=False)
            return
        try:
            reply = ask(run, {"act": act.value, "plan": shown["plan"] or None})
        except NobodyThere:
            return  # the panel is about to close by itself
        if not reply["ok"]:
            console.print(reply["sentence"], style="yellow", markup=False)

    console.print(f"Keys: {HELP}; Ctrl-C leaves the panel, not the run.", style="dim")
    with listening(typed, lambda: None):
        try:
            for notice in watch(run):
                _show(notice, console)
                shown["plan"] = notice["plan"]
        except KeyboardInterrupt:
            console.print("The run goes on without this panel.")
            return
    console.print("The run has ended.")


def _show(status: dict[str, Any], console: Console) -> None:
    console.print(f"{status['mode'].replace('_', ' ')}: {status['sentence']}", markup=False)
    if status["question"]:
        console.print(f"Plan {status['plan']} waits for approval:", style="bold")
        console.print(status["question"], markup=False)
    possible = ", ".join(word.replace("_", "-") for word in status["possible"])
    console.print(f"Possible now: {possible or 'nothing'}", style="dim", markup=False)
