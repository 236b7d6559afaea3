"""``defras tree``: look at trees and check them."""

from __future__ import annotations

from typing import Annotated

import typer

from defras_bt.cli.files import find
from defras_bt.executive.tree_file import read_tree
from defras_bt.executive.tree_show import outline_of_spec, show_mermaid, show_text

app = typer.Typer(help="Look at behaviour trees and check them.", no_args_is_help=True)
Tree = Annotated[str, typer.Argument(help="Tree: a file, or a shipped name.")]


@app.command("show")
def show(
    tree: Tree = "defras",
    mermaid: Annotated[bool, typer.Option("--mermaid", help="As a Mermaid diagram.")] = False,
) -> None:
    """Draw a tree in the terminal. Example: defras tree show defras"""
    outline = outline_of_spec(read_tree(find(tree, "trees")).root)
    typer.echo(show_mermaid(outline) if mermaid else show_text(outline))


@app.command("check")
def check(tree: Tree) -> None:
    """Check a tree file: every fault with its place. Example: defras tree check mine.yaml"""
    file = find(tree, "trees")
    spec = read_tree(file)
    count = sum(1 for _ in spec.root.walk())
    typer.echo(f"{file}: {spec.name} is valid, {count} nodes; every motion stands under a guard")
