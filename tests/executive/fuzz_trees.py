"""Files that are almost trees: whatever stands in them, reading gives a tree or faults with places.

``python -m tests.executive.fuzz_trees 10000`` tries that many files.
"""

from __future__ import annotations

import random
import sys
import tempfile
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from defras_bt.executive.registry import NODES, builtin_nodes
from defras_bt.executive.tree_dump import dump_tree
from defras_bt.executive.tree_file import read_tree
from defras_bt.executive.tree_kinds import KINDS
from defras_sim.resources import resource
from defras_sim.yaml_source import InvalidFile

_KEYS = ("name", "children", "child", "file", "ports", "tree", "state", "attempts", "succeed_when")
_VALUES = (
    "1",
    "-1",
    "0.5",
    "1e999",
    ".nan",
    "null",
    "~",
    "true",
    "no",
    "''",
    "all",
    "one",
    "2001-1-1",
)
_MARKS = ("{", "}", "[", "]", ":", ",", "- ", "\n", "\n  ", "\n    ", "\n      ", "# ", "|", ">")
_ODD = (
    "&a ",
    "*a",
    "<<: *a",
    "!!set ",
    "!!int ",
    "!!binary ",
    "? ",
    "---\n",
    "\t",
    "é",
    "\x07",
    "%",
)


def pieces() -> list[str]:
    """What files are made of, and damaged with."""
    kinds = [*KINDS, "subtree", *builtin_nodes()]
    files = [path.name for path in resource("trees").glob("*.yaml")]
    named = [f"{word}:" for word in (*kinds, *_KEYS)]
    return [*kinds, *named, *files, *_VALUES, *_MARKS * 3, *_ODD]


def almost_trees(chance: random.Random) -> Iterator[str]:
    """Damaged trees, heaps of words, and noise, for ever."""
    words = pieces()
    valid = [path.read_text(encoding="utf-8") for path in resource("trees").glob("*.yaml")]
    flat = [dump_tree(read_tree(path)) for path in resource("trees").glob("*.yaml")]
    while True:
        kind = chance.random()
        if kind < 0.75:
            yield _damaged(chance, chance.choice(valid + flat), words)
        elif kind < 0.95:
            some = (chance.choice(words) for _ in range(chance.randint(0, 40)))
            yield f"name: toy\ntree:{chance.choice((' ', '', chr(10)))}{' '.join(some)}"
        else:
            yield "".join(map(chr, (chance.randrange(1, 0x3000) for _ in range(60))))


def _damaged(chance: random.Random, text: str, words: list[str]) -> str:
    lines = text.splitlines(keepends=True)
    for _ in range(chance.randint(1, 3)):
        row = chance.randrange(len(lines))
        match chance.randrange(5):
            case 0:
                lines[row] = ""
            case 1:
                other = chance.randrange(len(lines))
                lines[row], lines[other] = lines[other], lines[row]
            case 2:
                lines.insert(row, lines[row])
            case 3:
                at = chance.randrange(len(lines[row]) + 1)
                end = at + chance.randint(0, 4)
                lines[row] = lines[row][:at] + chance.choice(words) + lines[row][end:]
            case _:
                lines[row] = chance.choice(("", "  ", "    ")) + lines[row].lstrip()
    return "".join(lines)


def try_one(text: str, folder: Path) -> str:
    """Read ``text`` as a tree beside the shipped ones.

    Returns:
        "read", "refused", or what is wrong with the answer, faults outside the file for example.
    """
    file = folder / "fuzzed.yaml"
    file.write_text(text, encoding="utf-8", errors="replace")
    try:
        tree = read_tree(file, NODES)
    except InvalidFile as error:
        lines = len(text.splitlines()) + 1
        for fault in error.faults:
            inside = fault.file != file or 1 <= fault.line <= lines
            if not inside or fault.column < 1 or not fault.message:
                return f"a fault without a place in the file: {fault}"
        return "refused" if error.faults else "refused without a fault"
    file.write_text(dump_tree(tree), encoding="utf-8")
    again = read_tree(file, NODES)
    if [path for path, _ in again.root.walk()] != [path for path, _ in tree.root.walk()]:
        return "another tree after it was written and read again"
    return "read"


def folder_of_trees(folder: Path) -> None:
    """Put the shipped trees into ``folder``, to be included."""
    for path in resource("trees").glob("*.yaml"):
        (folder / path.name).write_text(path.read_text(encoding="utf-8"), encoding="utf-8")


def fuzz(amount: int, seed: int, folder: Path) -> Counter[str]:
    """How often each answer was given.

    Raises:
        AssertionError: reading raised something else than faults; the file says what was read.
    """
    folder_of_trees(folder)
    answers: Counter[str] = Counter()
    texts = almost_trees(random.Random(seed))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # ruamel warns about odd tags, which are not trees anyway
        for _ in range(amount):
            text = next(texts)
            try:
                answers[try_one(text, folder)] += 1
            except Exception as error:
                raise AssertionError(f"{type(error).__name__}: {error}\n{text!r}") from error
    return answers


def main() -> None:
    amount = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    with tempfile.TemporaryDirectory() as folder:
        print(dict(fuzz(amount, seed, Path(folder))))


if __name__ == "__main__":
    main()
