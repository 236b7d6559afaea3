"""``defras dvrk simulate``: stand in for a dVRK."""

from __future__ import annotations

import signal
from datetime import UTC, datetime
from pathlib import Path
from types import FrameType
from typing import Annotated, get_args

import typer
from pydantic import ValidationError
from rich.console import Console

from defras_bt.cli.errors import UserError
from defras_bt.cli.files import find_scene, folder_for, require_folder
from defras_bt.dvrk.ros_packages import RosMissing
from defras_bt.dvrk.settings import Setup
from defras_bt.dvrk.stand_in.belief import measured_belief
from defras_bt.dvrk.stand_in.faults import read_faults
from defras_bt.dvrk.stand_in.imperfections import read_imperfections
from defras_bt.dvrk.stand_in.order import Clock, StandInOrder, WorldName
from defras_bt.dvrk.stand_in.set_up import (
    REGISTRATION_FILE,
    SCENE_FILE,
    SETUP_FILE,
    registration_of,
    set_up_of,
    write_set_up,
)
from defras_bt.dvrk.stand_in.stand_in import StandIn
from defras_bt.dvrk.transport.transport import ConnectionFailed
from defras_sim.scene import NotASlab, Scene


def simulate(
    scene: Annotated[str, typer.Argument(help="Scene as believed: a file, or a shipped name.")],
    actual: Annotated[
        str | None, typer.Option(help="Scene as it really is; default: as believed.")
    ] = None,
    world: Annotated[str, typer.Option(help="bullet (PyBullet) or model (fast).")] = "bullet",
    imperfections: Annotated[
        str, typer.Option(help="Of arms and cameras: lab (as measured), none, or a file.")
    ] = "lab",
    seed: Annotated[int, typer.Option(min=0, help="Of all noise.")] = 0,
    master: Annotated[str | None, typer.Option(help="URI of the ROS master.")] = None,
    port: Annotated[int, typer.Option(min=1024, max=65535, help="Of a master here.")] = 11311,
    clock: Annotated[
        str | None,
        typer.Option(help="real, or simulated (/clock); default: real for model worlds."),
    ] = None,
    speed: Annotated[
        float, typer.Option(min=0.01, max=10, help="Of a simulated clock, at most.")
    ] = 1.0,
    faults: Annotated[Path | None, typer.Option(help="What goes wrong, and when: a file.")] = None,
    witness: Annotated[
        Path | None, typer.Option(help="File for what really happened, for those who judge.")
    ] = None,
    set_up: Annotated[
        Path | None,
        typer.Option(
            help="Folder for the files that reach it (set-up, registration, the scene with what "
            "its arms do); it may have none yet."
        ),
    ] = None,
) -> None:
    """Stand in for a dVRK: two PSMs and their cameras over a real ROS 1 master.

    It speaks CRTK as a dVRK does and ends with Ctrl-C. Exit code: 0 ended by the user, 2 no master
    or invalid input, 1 the patient's world could not go on.

    Example: roscore -p 11500 & defras dvrk simulate demo --actual demo_actual --port 11500
    """
    console = Console(soft_wrap=True, highlight=False)
    _, believed = find_scene(scene)
    truth = believed if actual is None else find_scene(actual)[1]
    if world not in get_args(WorldName):
        raise UserError(f"--world {world}: valid are {', '.join(get_args(WorldName))}")
    chosen = clock or ("real" if world == "model" else "simulated")
    if chosen not in get_args(Clock):
        raise UserError(f"--clock {chosen}: valid are {', '.join(get_args(Clock))}")
    if imperfections not in ("lab", "none") and not Path(imperfections).is_file():
        raise UserError(f"--imperfections {imperfections}: valid are lab, none, or a file")
    order = StandInOrder(
        actual=truth,
        world="bullet" if world == "bullet" else "model",
        imperfections=read_imperfections(imperfections),
        seed=seed,
        master_uri=master or f"http://localhost:{port}",
        clock="real" if chosen == "real" else "simulated",
        speed=speed,
        faults=read_faults(faults) if faults is not None else (),
        witness=witness,
    )
    if witness is not None:
        require_folder(witness, "--witness")
    reached = _reached_at(order.master_uri, believed)
    try:
        belief = measured_belief(believed, order.imperfections, order.world)
    except NotASlab as error:
        raise UserError(f"--world {world}: {error}") from error
    if set_up is not None:
        _require_free(set_up)
    try:
        stand_in = StandIn(order, lambda what: console.print(what, style="yellow", markup=False))
    except (ConnectionFailed, RosMissing) as error:
        raise UserError(str(error)) from error
    if set_up is not None:
        measured = datetime.now(UTC).replace(microsecond=0)
        registration = registration_of(believed, order.imperfections, measured)
        file = write_set_up(set_up, reached, registration, belief)
        scene_file = set_up / SCENE_FILE
        console.print(f"It is reached with {scene_file} --setup {file}", markup=False)

    def end(_signal: int, _frame: FrameType | None) -> None:
        stand_in.stop()

    for ending in (signal.SIGINT, signal.SIGTERM):
        signal.signal(ending, end)
    console.print(
        f"Standing in for a dVRK at {order.master_uri}: {', '.join(truth.arms)} and two cameras, "
        f"{world} world, {chosen} clock, imperfections: {imperfections}. Ctrl-C ends it.",
        markup=False,
    )
    stand_in.run()


def _reached_at(master_uri: str, scene: Scene) -> Setup:
    """The set-up that reaches a stand-in at ``master_uri``."""
    try:
        return set_up_of(master_uri, scene)
    except ValidationError as error:
        why = "; ".join(fault["msg"] for fault in error.errors())
        raise UserError(
            f"--master {master_uri}: {why}; valid is what roscore prints as ROS_MASTER_URI, such "
            "as http://localhost:11311"
        ) from error


def _require_free(folder: Path) -> None:
    """See that nobody's set-up or registration would be written over in ``folder``."""
    folder_for(folder, "--set-up")
    written = (SETUP_FILE, REGISTRATION_FILE, SCENE_FILE)
    taken = [name for name in written if (folder / name).exists()]
    if taken:
        raise UserError(
            f"--set-up {folder}: has a {' and a '.join(taken)} already, which may be a robot's; "
            "give another folder, or leave --set-up out if they are this stand-in's"
        )
