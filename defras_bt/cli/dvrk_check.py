"""``defras dvrk check``: look at everything before the first motion."""

from __future__ import annotations

import sys
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from defras_bt.cli.errors import ExitCode, UserError
from defras_bt.cli.files import find_scene, folder_for
from defras_bt.dvrk.checking.finding import Finding
from defras_bt.dvrk.checking.motion import SPEED_M_S, STROKE_M
from defras_bt.dvrk.checking.report import CheckReport, fingerprint, write_check
from defras_bt.dvrk.checking.run import LISTEN_S, check_bench, run_checks, run_motion
from defras_bt.dvrk.laboratory import NotRegistered
from defras_bt.dvrk.ros_packages import RosMissing
from defras_bt.dvrk.settings import load_setup
from defras_bt.dvrk.transport.transport import ConnectionFailed
from defras_bt.planning.scene_hash import scene_hash

_MARKS = {"ok": ("ok", "green"), "warning": ("look", "yellow"), "wrong": ("WRONG", "bold red")}


def check(
    scene: Annotated[str, typer.Argument(help="Scene as believed: a file, or a shipped name.")],
    setup: Annotated[Path, typer.Option(help="Set-up file of the laboratory.")],
    approve: Annotated[
        bool, typer.Option("--approve", help="Move the arms by 2 mm without asking first.")
    ] = False,
    out: Annotated[
        Path, typer.Option(help="Folder where recordings will go, for its free space.")
    ] = Path(),
) -> None:
    """Look at arms, cameras, clocks, registration and workspace; then move 2 mm along each axis.

    Moves only after approval. Writes the check's file that defras run --world dvrk asks for
    (checked: in the set-up). Exit code: 0 passed, 2 invalid input or nobody answers, 3 something
    is wrong, 4 the motion was not approved.

    Example: defras dvrk check demo --setup lab/dvrk.yaml
    """
    console = Console(soft_wrap=True, highlight=False)
    believed = find_scene(scene)[1]
    laboratory = load_setup(setup)
    folder_for(out)
    said = f"Listening to {laboratory.name} for {LISTEN_S:g} s."
    listening = partial(console.print, said, markup=False)
    moved = False
    try:
        with check_bench(laboratory, believed, out, listening) as bench:
            findings = run_checks(bench, lambda finding: _tell(console, finding))
            sound = not any(one.grade == "wrong" for one in findings)
            if sound and _may_move(console, approve=approve):
                findings += run_motion(bench, lambda finding: _tell(console, finding))
                moved = True
    except (NotRegistered, RosMissing, ConnectionFailed) as error:
        raise UserError(str(error)) from error
    report = CheckReport(
        checked=datetime.now(UTC),
        setup=laboratory.fingerprint,
        registration=fingerprint(laboratory.registration),
        scene=scene_hash(believed),
        scene_name=believed.name,
        moved=moved,
        findings=tuple(findings),
    )
    write_check(report, laboratory.checked)
    console.print(f"Written to {laboratory.checked}", markup=False)
    if any(one.grade == "wrong" for one in findings):
        count = sum(one.grade == "wrong" for one in findings)
        console.print(f"The check failed: {count} things are wrong.", style="bold red")
        raise typer.Exit(ExitCode.NOT_REACHED)
    if not moved:
        console.print("Nothing is wrong so far, but the arms were not moved.", style="yellow")
        raise typer.Exit(ExitCode.HUMAN)
    console.print("The check passed.", style="bold green")


def _may_move(console: Console, *, approve: bool) -> bool:
    """Ask whoever stands beside the robot."""
    console.print(
        f"Now each arm would move {STROKE_M * 1e3:g} mm to and fro along x, y and z of the tissue "
        f"at {SPEED_M_S * 1e3:g} mm/s, and open its jaw a little. Its jaw must be empty and away "
        "from the tissue, and a hand on the emergency stop.",
        markup=False,
    )
    if approve:
        return True
    if not sys.stdin.isatty():
        console.print("Nobody can be asked here; --approve answers beforehand.", style="yellow")
        return False
    return typer.confirm("Move the arms?", default=False)


def _tell(console: Console, finding: Finding) -> None:
    mark, style = _MARKS.get(finding.grade, ("-", "dim"))
    text = f"{mark:>5}  {finding.check}: {finding.about}: {finding.what}."
    console.print(text, style=style, markup=False)
    if finding.todo:
        console.print(f"       {finding.todo}", markup=False)
