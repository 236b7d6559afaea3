"""``defras tree export-groot`` and ``import-groot``: trees and runs for Groot2, and back."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from defras_bt.cli.errors import UserError
from defras_bt.cli.files import find
from defras_bt.executive.registry import registered_nodes
from defras_bt.executive.tree_dump import dump_tree
from defras_bt.executive.tree_file import read_tree
from defras_bt.interop.groot_export import CannotExport, groot_xml
from defras_bt.interop.groot_import import import_groot as read_groot
from defras_bt.recording.decision_reader import InvalidDecisions
from defras_bt.recording.inputs_reader import NoInputs


def export_groot(
    tree: Annotated[str, typer.Argument(help="Tree file, shipped name, or folder of a run.")],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="File; default: XML to the terminal.")
    ] = None,
) -> None:
    """Write a tree as XML of BehaviorTree.CPP 4, or the log of a run for Groot2's log view.

    Kinds of nodes that BehaviorTree.CPP has under another meaning keep names of their own. The log
    of a run goes to run.btlog in its folder if --out does not say otherwise. Groot2 without a
    licence shows logs of trees of up to 20 nodes.

    Example: defras tree export-groot defras -o defras.xml; defras tree export-groot out/demo
    """
    try:
        if Path(tree).is_dir():
            target = out or Path(tree) / "run.btlog"
            if target.suffix != ".btlog":
                raise UserError(f"--out {target}: Groot2 opens logs that end in .btlog")
            # Reading a run takes all that can be recorded of one, and a second to load.
            from defras_bt.interop.btlog import btlog_of_run

            target.write_bytes(btlog_of_run(Path(tree), registered_nodes()))
        else:
            xml = groot_xml(read_tree(find(tree, "trees")), registered_nodes())
            if out is None:
                typer.echo(xml, nl=False)
                return
            target = out
            target.write_text(xml, encoding="utf-8")
    except (CannotExport, NoInputs, InvalidDecisions, OSError) as error:
        raise UserError(str(error)) from error
    typer.echo(f"Written to {target}")


def import_groot(
    file: Annotated[Path, typer.Argument(help="XML of BehaviorTree.CPP 4.")],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Tree file; default: to the terminal.")
    ] = None,
) -> None:
    """Turn XML of BehaviorTree.CPP 4 into a tree file; what would mean something else is refused.

    Example: defras tree import-groot defras.xml -o mine.yaml
    """
    text = dump_tree(read_groot(file))
    if out is None:
        typer.echo(text, nl=False)
        return
    try:
        out.write_text(text, encoding="utf-8")
    except OSError as error:
        raise UserError(f"--out {out}: {error}") from error
    typer.echo(f"Written to {out}")
