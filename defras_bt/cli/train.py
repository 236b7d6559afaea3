"""``defras train``: data for the networks that learn attachments, and their weights."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from defras_bt.cli.errors import UserError
from defras_bt.cli.files import folder_for
from defras_bt.cli.progress import counting, sentences

app = typer.Typer(help="Make training data, and train networks on it.", no_args_is_help=True)

DataFolder = Annotated[Path, typer.Option("--data", help="Folder of defras train data.")]
Out = Annotated[
    Path | None, typer.Option(help="Folder for checkpoint and weights; default: out/train-NAME.")
]
Epochs = Annotated[int, typer.Option(min=1, help="Most passes through the data.")]
Seed = Annotated[int, typer.Option(min=0)]
Threads = Annotated[int, typer.Option(min=1, help="Threads of computing.")]
Resume = Annotated[bool, typer.Option(help="Go on from the checkpoint in the folder.")]
Width = Annotated[int, typer.Option(min=8, max=128, help="Channels; a multiple of 8.")]


@app.callback()
def train() -> None:
    """Make training data, and train networks on it."""


@app.command("data")
def data(
    out: Annotated[Path, typer.Option(help="Folder for the data.")],
    samples: Annotated[int, typer.Option(min=1, help="About so many.")] = 3000,
    seed: Seed = 0,
    jobs: Annotated[int, typer.Option(min=1, help="Shards side by side.")] = 1,
) -> None:
    """Random retractions of random patients under wrong beliefs, as the twin predicts them.

    Goes on with what is in the folder already; more samples of the same seed add to it. Leaves
    shards (format: defras_bt/learning/data/shards.py), manifest.json, coverage.json and .html.

    Example: defras train data --out out/data --samples 3000 --seed 1 --jobs 2
    """
    from defras_bt.learning.data.coverage import write_coverage
    from defras_bt.learning.data.generate import Request, generate, missing_shards
    from defras_bt.learning.data.shards import InvalidData

    folder_for(out)
    request = Request(seed, samples)
    try:
        with _bar("shards", request.shards) as step:
            step(request.shards - len(missing_shards(out, request)))
            for _ in generate(out, request, jobs=jobs, tell=typer.echo):
                step(1)
        with _bar("looking what they cover", request.shards) as step:
            coverage = write_coverage(out, lambda done, of: step(1))
    except InvalidData as error:
        raise UserError(str(error)) from error
    typer.echo(
        f"{coverage.samples} samples in {out}, {100 * coverage.other_causes:.0f} % of them with a "
        "mismatch that is not due to attachments; see coverage.html there."
    )


@app.command("banet")
def banet(
    data: DataFolder,
    out: Out = None,
    epochs: Epochs = 20,
    seed: Seed = 0,
    threads: Threads = 2,
    width: Width = 8,
    resume: Resume = False,
) -> None:
    """Train the voxel network, after the paper's BANet.

    Example: defras train banet --data out/data --out out/banet --resume
    """
    _train("banet", {"width": width}, data, out, epochs, seed, threads, resume)


@app.command("sequence")
def sequence(
    data: DataFolder,
    out: Out = None,
    epochs: Epochs = 40,
    seed: Seed = 0,
    threads: Threads = 2,
    form: Annotated[str, typer.Option(help="grid or points.")] = "grid",
    width: Width = 40,
    resume: Resume = False,
) -> None:
    """Train the network that compares the last frames with the twin's prediction.

    Example: defras train sequence --data out/data --out out/sequence --resume
    """
    if form not in ("grid", "points"):
        raise UserError(f"--form {form}: valid are grid and points")
    _train("sequence", {"form": form, "width": width}, data, out, epochs, seed, threads, resume)


def _train(
    name: str,
    config: dict[str, object],
    data: Path,
    out: Path | None,
    epochs: int,
    seed: int,
    threads: int,
    resume: bool,
) -> None:
    from defras_bt.learning.data.shards import InvalidData
    from defras_bt.learning.networks.weights import built
    from defras_bt.learning.training.checkpoint import UnusableCheckpoint
    from defras_bt.learning.training.loop import Settings
    from defras_bt.learning.training.run import train_network

    try:
        built("banet" if name == "banet" else "sequence", config)
    except ValueError as error:
        raise UserError(f"--width: {error}") from error
    folder = out or Path(f"out/train-{name}")
    folder_for(folder)
    console = sentences()
    try:
        card = train_network(
            "banet" if name == "banet" else "sequence",
            config,
            data,
            folder,
            Settings(seed=seed, epochs=epochs),
            threads=threads,
            resume=resume,
            tell=lambda sentence: console.print(sentence, markup=False),
        )
    except (InvalidData, UnusableCheckpoint) as error:
        raise UserError(str(error)) from error
    typer.echo(json.dumps({k: card["metrics"][k] for k in ("all", "belief alone")}, indent=2))
    typer.echo(f"Written to {folder}: {name}.safetensors, {name}.json")


@contextmanager
def _bar(what: str, total: int) -> Iterator[Callable[[int], None]]:
    """A progress bar; what is yielded moves it on by so many."""
    console = Console(stderr=True)
    with counting(console) as bar:
        task = bar.add_task(what, total=total)
        yield lambda count: bar.advance(task, count)
