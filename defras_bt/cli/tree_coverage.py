"""``defras tree coverage``: which leaves and answers of a tree runs and tests have seen."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from defras_bt.cli.errors import ExitCode, UserError
from defras_bt.cli.files import find
from defras_bt.executive.tree_coverage import TreeCoverage, tree_coverage
from defras_bt.executive.tree_file import read_tree
from defras_bt.executive.tree_show import outline_of_spec, show_text
from defras_bt.recording.coverage import InvalidCoverage, read_coverage
from defras_bt.recording.decision_reader import InvalidDecisions


def coverage(
    runs: Annotated[
        list[Path],
        typer.Argument(help="Folders of defras run --out, files of pytest --tree-coverage."),
    ],
    tree: Annotated[
        str | None, typer.Option(help="Tree: a file, or a shipped name; default: all seen.")
    ] = None,
    fail_under: Annotated[
        float, typer.Option(min=0, max=100, help="Exit code 3 if less of the answers, in %.")
    ] = 0.0,
) -> None:
    """Show what of a tree was seen at work: every leaf, and each answer that it can give.

    Example: defras tree coverage out/demo --tree defras
    """
    try:
        seen = read_coverage(runs)
    except (InvalidCoverage, InvalidDecisions) as error:
        raise UserError(str(error)) from error
    names = [tree] if tree is not None else sorted(seen.trees)
    if not names:
        raise UserError("no tree was ticked there; give --tree to see all that is missing")
    poorest = 1.0
    for name in names:
        spec = read_tree(find(name, "trees"), must_be_guarded=False)
        covered = tree_coverage(spec, seen.trees.get(spec.name, {}))
        messages = {leaf.path: str(leaf) for leaf in covered.leaves}
        typer.echo(show_text(outline_of_spec(spec.root), messages=messages))
        for line in _summary(covered):
            typer.echo(line)
        poorest = min(poorest, covered.branch_share)
    if 100 * poorest < fail_under:
        raise typer.Exit(ExitCode.NOT_REACHED)


def _summary(covered: TreeCoverage) -> list[str]:
    actions = [leaf for leaf in covered.leaves if "*" in leaf.path]
    ticked = sum(leaf.ticked > 0 for leaf in covered.leaves)
    return [
        *(f"  {leaf.path}: {leaf}" for leaf in actions),
        f"{covered.tree}: {ticked} of {len(covered.leaves)} leaves were ticked "
        f"({covered.leaf_share:.0%}), {covered.branch_share:.0%} of their answers were seen",
    ]
