"""``defras dvrk record`` and ``topics``: bags of runs, and where things stand in them."""

from __future__ import annotations

import signal
from pathlib import Path
from threading import Event
from typing import Annotated

import typer
from rich.console import Console

from defras_bt.cli.errors import UserError
from defras_bt.cli.files import require_folder
from defras_bt.dvrk.registering.registration import read_registration
from defras_bt.dvrk.ros_packages import RosMissing
from defras_bt.dvrk.settings import Ros1Transport, load_setup
from defras_bt.dvrk.topic_recorder import TopicRecorder
from defras_bt.dvrk.topics_of import topics_of, write_topics
from defras_bt.dvrk.transport.ros1_node import join
from defras_bt.dvrk.transport.transport import ConnectionFailed

_LOOK_S = 0.5

Setup = Annotated[Path, typer.Option(help="Set-up file of the laboratory.")]


def record(
    bag: Annotated[Path, typer.Argument(help="ROS 1 bag to write.")],
    setup: Setup,
    without: Annotated[
        list[str] | None, typer.Option(help="Topic to leave out; may be given several times.")
    ] = None,
) -> None:
    """Record every topic of the ROS master into a ROS 1 bag, until Ctrl-C.

    As rosbag record -a does, where that is not installed. A bag that was begun before defras run
    --world dvrk replays into defras replay, and with the file of defras dvrk topics into defras
    diagnose.

    Example: defras dvrk record run.bag --setup lab.yaml --without /depth_camera/points
    """
    require_folder(bag, "BAG")
    if bag.exists():
        raise UserError(f"{bag} exists; give another name, or remove it first")
    transport = load_setup(setup).transport
    if not isinstance(transport, Ros1Transport):
        raise UserError(f"{setup}: transport {transport.kind} has no ROS 1 topics to record")
    console, ended = Console(soft_wrap=True, highlight=False), Event()
    try:
        join(transport, "defras_recorder")
        recorder = TopicRecorder(bag, without or ())
    except (RosMissing, ConnectionFailed, OSError) as error:
        raise UserError(str(error)) from error
    for ending in (signal.SIGINT, signal.SIGTERM):
        signal.signal(ending, lambda *_: ended.set())
    console.print(f"Recording into {bag}. Ctrl-C ends it.", markup=False)
    try:
        while not ended.wait(_LOOK_S):
            for topic in recorder.look():
                console.print(f"  {topic}", markup=False)
    finally:
        recorder.close()
    console.print(f"{recorder.messages} messages written to {bag}", markup=False)


def topics(
    setup: Annotated[Path, typer.Argument(help="Set-up file of the laboratory.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="Topic map to write.")],
) -> None:
    """Write where a set-up's readings stand in a bag of its topics, for defras diagnose --topics.

    Example: defras dvrk topics lab.yaml -o topics.yaml
    """
    require_folder(out)
    loaded = load_setup(setup)
    if not loaded.registration.is_file():
        raise UserError(f"{loaded.registration} does not exist: register arms and cameras first")
    registration = read_registration(loaded.registration)
    missing = [name for name in loaded.arms if name not in registration.arms]
    if missing:
        raise UserError(f"{loaded.registration} says nothing of {', '.join(missing)}")
    write_topics(topics_of(loaded, registration), out)
    typer.echo(f"Written to {out}")
