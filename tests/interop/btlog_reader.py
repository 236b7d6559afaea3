"""Reads a .btlog by its published layout, byte by byte; shares nothing with what writes it."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from xml.dom import minidom


@dataclass(frozen=True)
class BtLog:
    """``names``: path of each node by number; ``changes``: (microsecond, number, status)."""

    xml: str
    first_us: int
    names: dict[int, str]
    changes: list[tuple[int, int, int]]


def read_btlog(file: Path) -> BtLog:
    stream = io.BytesIO(file.read_bytes())
    assert stream.read(18).decode("ascii") == "BTCPP4-FileLogger2"
    assert stream.read(1) == b"\x01"
    size = int.from_bytes(stream.read(4), "little", signed=True)
    xml = stream.read(size).decode("utf-8")
    first_us = int.from_bytes(stream.read(8), "little", signed=True)
    changes = []
    while record := stream.read(9):
        assert len(record) == 9
        at, number = int.from_bytes(record[:6], "little"), int.from_bytes(record[6:8], "little")
        changes.append((at, number, record[8]))
    return BtLog(xml, first_us, _names(xml), changes)


def _names(xml: str) -> dict[int, str]:
    document = minidom.parseString(xml)
    found: dict[int, str] = {}

    def under(element: minidom.Element, above: str) -> None:
        for child in element.childNodes:
            if isinstance(child, minidom.Element):
                path = f"{above}{child.getAttribute('name')}"
                found[int(child.getAttribute("_uid"))] = path
                under(child, f"{path}/")

    for tree in document.getElementsByTagName("BehaviorTree"):
        under(tree, "")
    return found
