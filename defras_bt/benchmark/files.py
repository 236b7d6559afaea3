"""Every benchmark leaves NAME.json, NAME.csv and NAME.html."""

from __future__ import annotations

import csv
import html
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

_STYLE = """body{font:15px/1.5 system-ui,sans-serif;max-width:72rem;margin:2rem auto;padding:0 1rem}
table{border-collapse:collapse;width:100%;margin:1rem 0}th,td{padding:.3rem .6rem;text-align:right}
th{border-bottom:2px solid #345;vertical-align:bottom}td{border-bottom:1px solid #dde}
th:first-child,td:first-child{text-align:left}td:nth-child(-n+2){white-space:nowrap}.good{color:#186a3b}.bad{color:#922b21}svg{max-width:100%;height:auto}"""

Table = Sequence[Mapping[str, Any]]


def write_benchmark(
    out: Path,
    name: str,
    title: str,
    tables: Mapping[str, Table],
    notes: Sequence[str] = (),
    figures: Sequence[str] = (),
) -> None:
    """Write the ``tables`` (heading to rows, all rows of a table with the same keys).

    The CSV holds the last table, which is the one with a row per case. ``figures`` are SVG.
    """
    out.mkdir(parents=True, exist_ok=True)
    content = {"benchmark": name, "notes": list(notes), "tables": tables}
    (out / f"{name}.json").write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    rows = list(tables.values())[-1]
    with (out / f"{name}.csv").open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, list(rows[0]) if rows else [])
        writer.writeheader()
        writer.writerows(rows)
    body = "".join(f"<h2>{html.escape(head)}</h2>{_table(rows)}" for head, rows in tables.items())
    words = "".join(f"<p>{html.escape(note)}</p>" for note in notes)
    page = (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{html.escape(title)}</title>'
        f"<style>{_STYLE}</style><h1>{html.escape(title)}</h1>{words}{''.join(figures)}{body}</html>\n"
    )
    (out / f"{name}.html").write_text(page, encoding="utf-8")


def _table(rows: Table) -> str:
    if not rows:
        return "<p>no rows</p>"
    head = "".join(f"<th>{html.escape(str(key))}</th>" for key in rows[0])
    lines = "".join(f"<tr>{''.join(_cell(v) for v in row.values())}</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{lines}</tbody></table>"


def _cell(value: Any) -> str:
    text = f"{value:.3g}" if isinstance(value, float) else str("-" if value is None else value)
    mark = {"goal": ' class="good"', "human": ' class="bad"', "error": ' class="bad"'}
    return f"<td{mark.get(text, '')}>{html.escape(text)}</td>"
