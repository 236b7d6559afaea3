"""An MCAP file that is worth something at every moment of its writing.

rosbags writes MCAP too, but into a folder of its own, in chunks of a megabyte, and drops what is
pending when it is aborted. Here messages go out in a chunk whenever :meth:`McapFile.flush` is
called; what was flushed survives a killed process, and :func:`recover_mcap` indexes it again.
Layout: https://mcap.dev/spec (little-endian records of opcode, length and content).
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from os import SEEK_END
from pathlib import Path

MAGIC = b"\x89MCAP0\r\n"
_HEADER, _FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK = 1, 2, 3, 4, 5, 6
_MESSAGE_INDEX, _CHUNK_INDEX, _STATISTICS, _DATA_END = 7, 8, 11, 15
_FIRST_TIME = 2**64 - 1


@dataclass
class _Pending:
    """The chunk being filled. ``index``: per channel, (log time, offset) of each message."""

    content: bytearray = field(default_factory=bytearray)
    begin_ns: int = _FIRST_TIME
    end_ns: int = 0
    index: dict[int, list[tuple[int, int]]] = field(default_factory=dict)


class McapFile:
    """Writes ROS 2 messages in chunks; use :meth:`close` or ``with`` to give the file its index."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("wb")
        self._definitions: list[bytes] = []
        self._schemas: dict[str, int] = {}
        self._counts: dict[int, int] = {}
        self._chunk_index: list[bytes] = []
        self._begin_ns, self._end_ns = _FIRST_TIME, 0
        self._pending = _Pending()
        self._file.write(MAGIC + _record(_HEADER, _text("ros2") + _text("defras")))

    def __enter__(self) -> McapFile:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def add_channel(self, topic: str, message_type: str, definition: str) -> int:
        """Announce a topic; returns the number that its messages carry."""
        if message_type not in self._schemas:
            self._schemas[message_type] = len(self._schemas) + 1
            named = _text(message_type) + _text("ros2msg") + _text(definition)
            self._define(_SCHEMA, struct.pack("<H", self._schemas[message_type]) + named)
        channel = len(self._counts) + 1
        self._counts[channel] = 0
        numbers = struct.pack("<HH", channel, self._schemas[message_type])
        metadata = _text("offered_qos_profiles") + _text("")
        self._define(_CHANNEL, numbers + _text(topic) + _text("cdr") + _block(metadata))
        return channel

    def write(self, channel: int, log_ns: int, publish_ns: int, data: bytes | memoryview) -> None:
        """Queue a message: when it was recorded, when it was measured, and its CDR bytes."""
        pending = self._pending
        pending.index.setdefault(channel, []).append((log_ns, len(pending.content)))
        pending.begin_ns = min(pending.begin_ns, log_ns)
        pending.end_ns = max(pending.end_ns, log_ns)
        numbers = struct.pack("<HIQQ", channel, self._counts[channel], log_ns, publish_ns)
        pending.content += _record(_MESSAGE, numbers + bytes(data))
        self._counts[channel] += 1

    def flush(self) -> None:
        """Put everything queued on disk as one chunk."""
        pending, self._pending = self._pending, _Pending()
        if pending.content:
            self._write_chunk(pending)
        self._file.flush()

    def close(self) -> None:
        """Write what is queued and the index. The file cannot be written to after it."""
        if self._file.closed:
            return
        self.flush()
        self._file.write(_record(_DATA_END, struct.pack("<I", 0)))
        summary_at = self._file.tell()
        self._file.write(b"".join(self._definitions))
        self._file.write(b"".join(self._chunk_index))
        self._file.write(_record(_STATISTICS, self._statistics()))
        self._file.write(_record(_FOOTER, struct.pack("<QQI", summary_at, 0, 0)) + MAGIC)
        self._file.close()

    def _define(self, opcode: int, content: bytes) -> None:
        record = _record(opcode, content)
        self._definitions.append(record)
        # Pending messages keep their place; a definition may stand between chunks.
        self._file.write(record)

    def _write_chunk(self, pending: _Pending) -> None:
        content = bytes(pending.content)
        times = struct.pack("<QQ", pending.begin_ns, pending.end_ns)
        sized = struct.pack("<QI", len(content), zlib.crc32(content)) + _text("")
        at = self._file.tell()
        self._file.write(_record(_CHUNK, times + sized + struct.pack("<Q", len(content)) + content))
        indexed_from = self._file.tell()
        offsets = b""
        for channel, entries in pending.index.items():
            offsets += struct.pack("<HQ", channel, self._file.tell())
            listed = b"".join(struct.pack("<QQ", *entry) for entry in entries)
            self._file.write(_record(_MESSAGE_INDEX, struct.pack("<H", channel) + _block(listed)))
        where = struct.pack("<QQ", at, indexed_from - at) + _block(offsets)
        length = struct.pack("<Q", self._file.tell() - indexed_from)
        sizes = _text("") + struct.pack("<QQ", len(content), len(content))
        self._chunk_index.append(_record(_CHUNK_INDEX, times + where + length + sizes))
        self._begin_ns = min(self._begin_ns, pending.begin_ns)
        self._end_ns = max(self._end_ns, pending.end_ns)

    def _statistics(self) -> bytes:
        total = sum(self._counts.values())
        sizes = (len(self._schemas), len(self._counts), 0, 0, len(self._chunk_index))
        times = (self._begin_ns, self._end_ns) if total else (0, 0)
        counts = b"".join(struct.pack("<HQ", *item) for item in self._counts.items())
        return struct.pack("<QHIIIIQQ", total, *sizes, *times) + _block(counts)


def is_cut_off(path: Path) -> bool:
    """Whether this is an MCAP file without its end, as a killed process leaves one."""
    with path.open("rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            return False
        size = file.seek(0, SEEK_END)
        file.seek(max(len(MAGIC), size - len(MAGIC)))
        return file.read() != MAGIC


def recover_mcap(broken: Path, repaired: Path) -> int:
    """Copy every whole chunk of a file without end; returns the number of messages saved.

    Raises:
        ValueError: the file does not begin like MCAP.
    """
    saved = 0
    schemas: dict[int, tuple[str, str]] = {}
    channels: dict[int, int] = {}
    with McapFile(repaired) as target:
        for opcode, content in _whole_records(broken):
            if opcode == _SCHEMA:
                (number,) = struct.unpack_from("<H", content)
                name, _, definition = _texts(content, 2, 3)
                schemas[number] = (name, definition)
            elif opcode == _CHANNEL:
                number, schema = struct.unpack_from("<HH", content)
                (topic,) = _texts(content, 4, 1)
                channels[number] = target.add_channel(topic, *schemas[schema])
            elif opcode == _CHUNK:
                # Times, size, checksum, an empty name of the compression and the length of records.
                for _, message in _records(content[40:]):
                    channel, _, log_ns, publish_ns = struct.unpack_from("<HIQQ", message)
                    target.write(channels[channel], log_ns, publish_ns, message[22:])
                    saved += 1
                target.flush()
    return saved


def _whole_records(path: Path) -> Iterator[tuple[int, bytes]]:
    content = path.read_bytes()
    if not content.startswith(MAGIC):
        raise ValueError(f"{path} does not begin like an MCAP file")
    yield from _records(content[len(MAGIC) :])


def _records(content: bytes) -> Iterator[tuple[int, bytes]]:
    at = 0
    while at + 9 <= len(content):
        opcode, length = struct.unpack_from("<BQ", content, at)
        if at + 9 + length > len(content):
            return
        yield opcode, content[at + 9 : at + 9 + length]
        at += 9 + length


def _record(opcode: int, content: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(content)) + content


def _block(content: bytes) -> bytes:
    return struct.pack("<I", len(content)) + content


def _text(text: str) -> bytes:
    return _block(text.encode())


def _texts(content: bytes, at: int, count: int) -> list[str]:
    found = []
    for _ in range(count):
        (length,) = struct.unpack_from("<I", content, at)
        found.append(content[at + 4 : at + 4 + length].decode())
        at += 4 + length
    return found
