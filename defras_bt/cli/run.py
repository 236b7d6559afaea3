"""``defras run``: operate."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from defras_bt.cli.at_the_desk import at_the_desk
from defras_bt.cli.dvrk_laboratory import checked_laboratory, connected, slowed, told_to_ros
from defras_bt.cli.errors import OUTCOME_CODES, ExitCode, UserError
from defras_bt.cli.files import find, find_scene, folder_for
from defras_bt.cli.interrupts import Interrupts
from defras_bt.cli.plan import rehearsed, tell
from defras_bt.cli.run_requirements import (
    require_asked,
    require_no_trial,
    require_safe,
    require_same_set_up,
)
from defras_bt.executive.deadline import LONGEST_RECOVERY_S, interrupting
from defras_bt.executive.operation import (
    ROBOT_WORLD,
    WORLDS,
    Operation,
    operate,
    operate_in,
    random_generators,
)
from defras_bt.executive.operator_desk import OperatorDesk
from defras_bt.executive.substitution import NOTHING_SUBSTITUTED, read_substitutes
from defras_bt.executive.tree_file import read_tree
from defras_bt.faults.faults import NO_FAULTS, FaultInjection
from defras_bt.faults.file import read_faults
from defras_bt.learning.networks.own_weights import OwnWeights
from defras_bt.planning.preparation import needs_plan
from defras_bt.recording.bag import BagRecorder
from defras_bt.recording.composite import RecordingFailed
from defras_bt.recording.decisions import DECISIONS_FILE, DecisionRecorder
from defras_bt.recording.progress import EventPrinter, ProgressLine
from defras_bt.recording.record import Recorder
from defras_bt.recording.report import ReportRecorder
from defras_bt.recording.run_file import STREAM_FILE
from defras_bt.recording.summary import SummaryRecorder
from defras_bt.recording.timeline import TimelineRecorder

LEFT = ("run.rrd", "recording.mcap", DECISIONS_FILE, "run.json", "report.html")
"""The files that a run leaves in its folder; on a robot the log of its set-points as well."""


def run(
    scene: Annotated[str, typer.Argument(help="Scene as believed: a file, or a shipped name.")],
    actual: Annotated[
        str | None, typer.Option(help="Scene as it really is; default: as believed.")
    ] = None,
    world: Annotated[
        str, typer.Option(help="model (fast), bullet (PyBullet) or dvrk (a robot; needs --setup).")
    ] = "model",
    setup: Annotated[
        Path | None, typer.Option(help="Set-up file of the laboratory, for --world dvrk.")
    ] = None,
    tree: Annotated[str, typer.Option(help="Tree: a file, or a shipped name.")] = "defras",
    plan: Annotated[
        Path | None, typer.Option(help="Plan file of defras plan; default: rehearse now.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for what the run leaves.")] = None,
    replace: Annotated[
        bool, typer.Option("--replace", help="Give up what an earlier run left in --out.")
    ] = False,
    seed: Annotated[int, typer.Option(min=0, help="Same seed, same run (model world).")] = 0,
    max_time: Annotated[
        float, typer.Option(min=1, help="Longest world time in s, learning not counted.")
    ] = 300.0,
    substitute: Annotated[
        Path | None,
        typer.Option(help="File that replaces nodes by scripts, to try out what would happen."),
    ] = None,
    faults: Annotated[
        str | None, typer.Option(help="Faults to inject: a file, or a shipped name.")
    ] = None,
    weights: Annotated[
        Path | None, typer.Option(help="Folder of defras train; default: the shipped weights.")
    ] = None,
    approve: Annotated[
        bool, typer.Option("--approve", help="Show each plan and wait for the operator's approval.")
    ] = False,
) -> None:
    """Retract the tissue until the region of interest is visible.

    Leaves run.rrd, recording.mcap, decisions.jsonl, run.json and report.html in --out. Exit code:
    0 goal reached, 2 invalid input, 3 goal not reached, 4 a human was asked, 1 internal error, or
    goal reached but not everything could be recorded. Ctrl-C stops the arms and asks a human. A
    tree that is not proved safe (see defras tree prove) is not run.

    On a robot (--world dvrk --setup FILE) a passed check of the same set-up and scene has to be
    there that is not too old: see defras dvrk check.

    While it runs, keys and "defras operator" pause, resume, stop, take over and hand back.

    Example: defras run demo --actual demo_actual --world bullet --out out/demo
    """
    if world not in (*WORLDS, ROBOT_WORLD):
        raise UserError(f"--world {world}: valid are {', '.join((*WORLDS, ROBOT_WORLD))}")
    scene_file, believed = find_scene(scene)
    laboratory = None
    if world == ROBOT_WORLD:
        require_no_trial(actual=actual, substitute=substitute, faults=faults)
        laboratory = checked_laboratory(setup, believed)
    elif setup is not None:
        raise UserError(f"--setup {setup}: only --world {ROBOT_WORLD} has a laboratory")
    actual_file, truth = find_scene(actual) if actual is not None else (None, believed)
    require_same_set_up(believed, truth)
    tree_file = find(tree, "trees")
    tree_spec = read_tree(tree_file)
    require_safe(tree_spec, tree)
    substitutes = NOTHING_SUBSTITUTED if substitute is None else read_substitutes(substitute)
    substituted = substitutes.paths(tree_spec)
    own_weights = None if weights is None else OwnWeights.of(weights)
    if own_weights is not None:
        require_asked(own_weights, tree_spec)
    injected = NO_FAULTS
    if faults is not None:
        injected = read_faults(find(faults, "sim/faults"), believed.arms)
    if out is not None:
        _require_unused(out, replace=replace)
    console = Console(soft_wrap=True, highlight=False)
    prepared = rehearsed(
        believed.for_bullet() if world == "bullet" else believed,
        console,
        with_plan=needs_plan(tree_spec),
        plan_file=plan,
    )
    if prepared.result is not None:
        tell(prepared.result, console)
    if laboratory is not None:
        believed = slowed(believed, laboratory)
    operation = Operation(
        scene=believed,
        actual=truth if laboratory is None else None,
        scene_file=str(scene_file),
        actual_file=str(actual_file) if actual_file else None,
        world=world,
        tree_file=tree_file,
        seed=seed,
        force_threshold_n=prepared.force_threshold_n,
        preoperative=prepared.plan,
        max_time_s=max_time,
        substitutes=substitutes,
        weights=own_weights,
    )
    if substituted:
        console.print(
            f"A TRIAL, NOT AN OPERATION: {len(substituted)} of the tree's nodes are replaced by "
            f"scripts ({substitute}).",
            style="bold yellow",
        )
    if injected.faults:
        kinds = ", ".join(fault.kind for fault in injected.faults)
        console.print(
            f"A TRIAL, NOT AN OPERATION: faults are injected ({kinds}).", style="bold yellow"
        )
    # A robot's time passes by itself; a simulated one must not race while a human thinks.
    desk = OperatorDesk(asks=approve, idle_s=believed.tick_s if laboratory is None else 0.0)
    interrupts = Interrupts(desk, last_deed=True)
    operating, of_robot = partial(operate, operation), list[Recorder]()
    if laboratory is not None:
        robot = connected(laboratory, believed, out)
        of_robot = told_to_ros(laboratory, robot)
        operating = partial(operate_in, robot, operation, random_generators(seed)[1])
    # Only now: what an earlier run left is not given up for a robot that does not answer.
    recorded = file_recorders(out) if out is not None else []
    recorders: list[Recorder] = [EventPrinter(console), ProgressLine(console)]
    recorders += [*recorded, *of_robot]
    try:
        with at_the_desk(desk, console, out, asks=approve), interrupts.heeded():
            summary = operating(
                recorders,
                operator=desk,
                faults=FaultInjection(injected, believed, seed),
                deadline=interrupting(recovery_s=LONGEST_RECOVERY_S),
                finishing=partial(_ended, desk, interrupts),
            )
    except KeyboardInterrupt:
        console.print("Ended by the operator; the arms were stopped first.", style="bold red")
        raise typer.Exit(ExitCode.INTERNAL) from None
    except RecordingFailed as failed:
        console.print(
            f"Not everything was recorded: {failed.message}.", style="bold red", markup=False
        )
        raise typer.Exit(code_without_record(str(failed.summary.values["outcome"]))) from failed
    if out is not None:
        console.print(f"Written to {out}: {', '.join(_there(out))}")
    raise typer.Exit(OUTCOME_CODES[str(summary.values["outcome"])])


@contextmanager
def _ended(desk: OperatorDesk, interrupts: Interrupts) -> Iterator[None]:
    """While recordings are finished nobody can ask for anything, and nobody interrupts."""
    with interrupts.finishing():
        desk.close()
        yield


def code_without_record(outcome: str) -> ExitCode:
    """Exit code of a run that was not recorded whole.

    A run that ended without its goal says that first. One that reached it did not leave what it
    should have, and must not pass for a success.
    """
    code = OUTCOME_CODES[outcome]
    return ExitCode.INTERNAL if code == ExitCode.GOAL else code


def file_recorders(out: Path) -> list[Recorder]:
    """The recorders that write what a run leaves, in ``out``; what is there of that is removed.

    Raises:
        UserError: the folder cannot be made.
    """
    folder_for(out)
    for name in (*LEFT, STREAM_FILE):
        (out / name).unlink(missing_ok=True)
    timeline, bag, decisions, numbers, report = (out / name for name in LEFT)
    return [
        TimelineRecorder(timeline),
        BagRecorder(bag),
        DecisionRecorder(decisions),
        SummaryRecorder(numbers),
        ReportRecorder(report),
    ]


def _require_unused(out: Path, *, replace: bool) -> None:
    """See that nothing recorded is lost.

    Raises:
        UserError: the folder cannot be made, or holds what an earlier run left, which only
            ``replace`` gives up.
    """
    folder_for(out)
    there = _there(out)
    if there and not replace:
        raise UserError(
            f"--out {out}: an earlier run left {', '.join(there)} there, which would be lost; give "
            "another folder, or --replace to give them up"
        )


def _there(out: Path) -> list[str]:
    """Which of the files that runs leave are in a folder."""
    return [name for name in (*LEFT, STREAM_FILE) if (out / name).exists()]
