"""``defras tree``: look at trees, check them, and prove that they are safe."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from defras_bt.cli.errors import ExitCode, UserError
from defras_bt.cli.files import find, folder_for
from defras_bt.cli.tree_coverage import coverage
from defras_bt.cli.tree_groot import export_groot, import_groot
from defras_bt.executive.proof.as_json import proof_json
from defras_bt.executive.proof.prover import prove
from defras_bt.executive.proof.report import proof_text
from defras_bt.executive.tree_diff import tree_diff
from defras_bt.executive.tree_dump import dump_tree
from defras_bt.executive.tree_file import read_tree
from defras_bt.executive.tree_picture import show_svg
from defras_bt.executive.tree_show import Outline, outline_of_spec, show_mermaid, show_text

app = typer.Typer(help="Look at behaviour trees, check and prove them.", no_args_is_help=True)
Tree = Annotated[str, typer.Argument(help="Tree: a file, or a shipped name.")]

app.command("coverage")(coverage)
app.command("export-groot")(export_groot)
app.command("import-groot")(import_groot)


@app.command("show")
def show(
    tree: Tree = "defras",
    mermaid: Annotated[bool, typer.Option("--mermaid", help="As a Mermaid diagram.")] = False,
    as_yaml: Annotated[
        bool, typer.Option("--yaml", help="As one file, with its includes put in.")
    ] = False,
    picture: Annotated[
        Path | None, typer.Option("--picture", help="Draw it into this SVG file.", dir_okay=False)
    ] = None,
) -> None:
    """Draw a tree in the terminal. Example: defras tree show defras --picture defras.svg"""
    spec = read_tree(find(tree, "trees"), must_be_guarded=False)
    outline = outline_of_spec(spec.root)
    if as_yaml:
        typer.echo(dump_tree(spec), nl=False)
    elif picture is None:
        typer.echo(show_mermaid(outline) if mermaid else show_text(outline))
    else:
        _draw(tree, outline, picture)


def _draw(tree: str, outline: Outline, picture: Path) -> None:
    if picture.suffix != ".svg":
        raise UserError(f"--picture {picture}: give a file that ends with .svg")
    folder_for(picture.parent)
    picture.write_text(show_svg(outline), encoding="utf-8")
    typer.echo(f"{picture}: {tree} is drawn; open it with a browser")


@app.command("check")
def check(tree: Tree) -> None:
    """Check a tree file: every fault with its place. Example: defras tree check mine.yaml

    It checks that the file is well-formed and that guards stand before every motion. `defras tree
    prove` proves that they stop it, and `defras run` runs no tree for which that fails.
    """
    file = find(tree, "trees")
    spec = read_tree(file)
    count = sum(1 for _ in spec.root.walk())
    typer.echo(
        f"{file}: {spec.name} is well-formed, {count} nodes, and guards stand before every motion; "
        f"whether they stop it in time was not looked at: see `defras tree prove {tree}`"
    )


@app.command("prove")
def prove_tree(
    tree: Tree,
    actions: Annotated[
        int | None,
        typer.Option(min=0, help="Prove it for a plan of this length; left out: for any length."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Answer in JSON.")] = False,
) -> None:
    """Prove that guards stop every motion in time. Example: defras tree prove defras

    For the tree as written and after any plan was put into it; exit code 2 with the ticks that
    break a claim, and the node at fault, where one does not hold.
    """
    file = find(tree, "trees")
    spec = read_tree(file, must_be_guarded=False)
    proof = prove(spec) if actions is None else prove(spec, (actions,))
    if as_json:
        typer.echo(proof_json(proof, actions).model_dump_json(indent=2))
    else:
        typer.echo(proof_text(proof))
        plans = "plans of any length" if actions is None else f"a plan of {actions} actions"
        verdict = "is safe: proved" if proof.holds else "is not safe: looked at"
        typer.echo(f"{file}: {spec.name} {verdict} from every state, for {plans}")
    if not proof.holds:
        raise typer.Exit(ExitCode.INVALID)


@app.command("diff")
def diff(
    old: Annotated[str, typer.Argument(help="Tree as it was: a file, or a shipped name.")],
    new: Annotated[str, typer.Argument(help="Tree as it is.")],
) -> None:
    """Say what changed between two trees, by meaning. Example: defras tree diff fras mine.yaml

    Lost guards come first. Comments, layout, and whether a part stands in a file of its own mean
    nothing.
    """
    before, after = (read_tree(find(name, "trees"), must_be_guarded=False) for name in (old, new))
    changes = tree_diff(before, after)
    for change in changes:
        typer.echo(change)
    lost = sum(change.kind == "guard lost" for change in changes)
    if lost:
        typer.echo(f"{lost} guard(s) lost: see `defras tree prove {new}`")
    if not changes:
        typer.echo(f"{old} and {new} mean the same")
