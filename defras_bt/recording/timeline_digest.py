"""A fingerprint of what a timeline says, for golden tests."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

from rerun.chunk import RrdReader

_ROW_ID = "rerun.controls.RowId"


def timeline_digest(path: Path) -> str:
    """SHA-256 of every column of every chunk, in an order that does not depend on the file's.

    Row and chunk ids are left out: they are made from the time of day. So is the viewer's layout.
    """
    chunks = RrdReader(path).stream().to_chunks()
    content = sorted(_chunk_digest(chunk.entity_path, chunk.to_record_batch()) for chunk in chunks)
    return hashlib.sha256("\n".join(content).encode()).hexdigest()


def _chunk_digest(entity_path: str, batch: Any) -> str:
    names = sorted(name for name in batch.schema.names if name != _ROW_ID)
    kept = batch.select(names)
    digest = hashlib.sha256(f"{entity_path}\0".encode())
    for name in names:
        digest.update(f"{name}\0{kept.schema.field(name).type}\0".encode())
    # Arrow's own serialisation: without the schema and its ids, slices cut to what they show.
    digest.update(kept.serialize())
    return digest.hexdigest()
