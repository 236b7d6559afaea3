"""All commands together, and what becomes of their errors."""

from __future__ import annotations

import os
import sys

import typer
from rich.console import Console

from defras_bt.cli import benchmark, doctor, explain, plan, run, scene, tree, view
from defras_bt.cli.errors import ExitCode, UserError
from defras_bt.executive.executive import ExecutiveFailed
from defras_bt.recording.composite import RecordingFailed
from defras_sim.yaml_source import InvalidFile

app = typer.Typer(
    name="defras",
    help="Retract soft tissue autonomously while the model of the patient is not trusted.",
    no_args_is_help=True,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
)
app.command("run")(run.run)
app.command("plan")(plan.plan)
app.command("explain")(explain.explain)
app.command("view")(view.view)
app.command("doctor")(doctor.doctor)
app.add_typer(scene.app, name="scene")
app.add_typer(tree.app, name="tree")
app.add_typer(benchmark.app, name="benchmark")


def run_commands() -> None:
    """Run the command line; exit codes are those of :class:`ExitCode`."""
    console = Console(stderr=True, soft_wrap=True, highlight=False)
    try:
        app()
    except InvalidFile as error:
        for fault in error.faults:
            console.print(str(fault), style="red", markup=False)
        sys.exit(ExitCode.INVALID)
    except UserError as error:
        console.print(str(error), style="red", markup=False)
        sys.exit(ExitCode.INVALID)
    except Exception as error:
        if os.environ.get("DEFRAS_DEBUG"):
            raise
        what = error if isinstance(error, ExecutiveFailed | RecordingFailed) else _named(error)
        console.print(f"internal error: {what}", style="red", markup=False)
        console.print("Set DEFRAS_DEBUG=1 to see where it happened.", style="dim")
        sys.exit(ExitCode.INTERNAL)


def _named(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"
