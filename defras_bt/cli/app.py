"""All commands together, and what becomes of their errors."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.metadata import version
from typing import Annotated

import typer
from rich.console import Console

from defras_bt.cli.errors import ExitCode, UserError
from defras_bt.learning.networks.no_weights import NoWeights
from defras_sim.rest_shape import NotASlab
from defras_sim.worlds.error import CannotImitate
from defras_sim.yaml_source import InvalidFile

COMMANDS = ("run", "plan", "view", "explain", "operator", "replay", "diagnose", "doctor")
"""Commands, each the function of its name in the module of its name."""

GROUPS = ("scene", "tree", "train", "benchmark", "dvrk")
"""Groups of commands, each the ``app`` of the module of its name."""


_SPOKEN = ("ExecutiveFailed", "RecordingFailed")
"""Errors whose message says it all; by name, because their modules are loaded only where needed."""


def _tell_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"defras {version('defras')}")
        raise typer.Exit


def application(arguments: Sequence[str]) -> typer.Typer:
    """The command line as far as ``arguments`` need it.

    Loading everything takes seconds, most of it for drawing and simulating. So only the command
    that is asked for is loaded, and all of them where none is or help is wanted.
    """
    app = typer.Typer(
        name="defras",
        help="Retract soft tissue autonomously while the model of the patient is not trusted.",
        no_args_is_help=True,
        rich_markup_mode="rich",
        pretty_exceptions_enable=False,
    )
    # A group keeps its name only beside another command, so the callback is there for all cases.
    app.callback()(_everywhere)
    asked = arguments[0] if arguments else ""
    known = asked in (*COMMANDS, *GROUPS, "--version")
    for name in COMMANDS:
        if name == asked or not known:
            app.command(name)(getattr(import_module(f"defras_bt.cli.{name}"), name))
    for name in GROUPS:
        if name == asked or not known:
            app.add_typer(import_module(f"defras_bt.cli.{name}").app, name=name)
    return app


def _everywhere(
    tell_version: Annotated[
        bool,
        typer.Option(
            "--version", is_eager=True, callback=_tell_version, help="Say which version this is."
        ),
    ] = False,
) -> None:
    """What may stand before every command."""


def run_commands() -> None:
    """Run the command line; exit codes are those of :class:`ExitCode`."""
    console = Console(stderr=True, soft_wrap=True, highlight=False)
    try:
        application(sys.argv[1:])()
    except InvalidFile as error:
        for fault in error.faults:
            console.print(str(fault), style="red", markup=False)
        sys.exit(ExitCode.INVALID)
    except (UserError, NoWeights, NotASlab, CannotImitate) as error:
        console.print(str(error), style="red", markup=False)
        sys.exit(ExitCode.INVALID)
    except Exception as error:
        if os.environ.get("DEFRAS_DEBUG"):
            raise
        what = error if type(error).__name__ in _SPOKEN else f"{type(error).__name__}: {error}"
        console.print(f"internal error: {what}", style="red", markup=False)
        console.print("Set DEFRAS_DEBUG=1 to see where it happened.", style="dim")
        sys.exit(ExitCode.INTERNAL)
