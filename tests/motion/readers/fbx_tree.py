"""Tree of an FBX file, and its two notations: ASCII, and binary of any version 7."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

MAGIC = b"Kaydara FBX Binary  \0\x1a\0"
WIDE_VERSION = 7500
"""First version whose offsets have 64 bits."""


@dataclass(frozen=True, slots=True)
class ObjectName:
    """Name of an object with its class."""

    kind: str
    name: str


Value = int | float | str | ObjectName | npt.NDArray[Any]


@dataclass(slots=True)
class FbxNode:
    """Node with its values and its children, which may be an empty block."""

    name: str
    values: list[Value] = field(default_factory=list)
    children: list[FbxNode] | None = None

    def child(self, name: str) -> FbxNode:
        """Return the first child of this name."""
        return next(node for node in self.children or () if node.name == name)


def block(name: str, *values: Value, children: Sequence[FbxNode] = ()) -> FbxNode:
    """Return a node with a block of children."""
    return FbxNode(name, list(values), list(children))


def leaf(name: str, *values: Value) -> FbxNode:
    """Return a node without a block."""
    return FbxNode(name, list(values))


def to_ascii(nodes: Sequence[FbxNode], version: int = 7400) -> bytes:
    """Return the file in ASCII."""
    comment = f"; FBX {version // 1000}.{version // 100 % 10}.0 project file\n"
    return (comment + "\n".join(line for node in nodes for line in _ascii_lines(node)) + "\n").encode()


def _ascii_lines(node: FbxNode) -> Iterator[str]:
    if len(node.values) == 1 and isinstance(node.values[0], np.ndarray):
        numbers = ",".join(_ascii_number(value) for value in node.values[0].tolist())
        yield f"{node.name}: *{len(node.values[0])} {{\na: {numbers}\n}}"
        return
    values = ", ".join(_ascii_value(value) for value in node.values)
    if node.children is None:
        yield f"{node.name}: {values}"
        return
    yield f"{node.name}: {values} {{"
    for child in node.children:
        yield from _ascii_lines(child)
    yield "}"


def _ascii_number(value: float) -> str:
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def _ascii_value(value: Value) -> str:
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, ObjectName):
        return f'"{value.kind}::{value.name}"'
    assert isinstance(value, int | float)
    return _ascii_number(value)


def to_binary(nodes: Sequence[FbxNode], version: int = 7400, compress: bool = False) -> bytes:
    """Return the file in binary, with arrays compressed or not."""
    data = bytearray(MAGIC + struct.pack("<I", version))
    for node in nodes:
        _append(data, node, version >= WIDE_VERSION, compress)
    data += bytes(25 if version >= WIDE_VERSION else 13)
    return bytes(data) + bytes(160)


def _append(data: bytearray, node: FbxNode, is_wide: bool, compress: bool) -> None:
    head = struct.Struct("<QQQB" if is_wide else "<IIIB")
    start = len(data)
    name = node.name.encode()
    values = b"".join(_binary_value(value, compress) for value in node.values)
    data += bytes(head.size) + name + values
    if node.children is not None:
        for child in node.children:
            _append(data, child, is_wide, compress)
        data += bytes(head.size)
    head.pack_into(data, start, len(data), len(node.values), len(values), len(name))


def _binary_value(value: Value, compress: bool) -> bytes:
    if isinstance(value, np.ndarray):
        kind, dtype = ("l", "<i8") if value.dtype.kind == "i" else ("d", "<f8")
        raw = value.astype(dtype).tobytes()
        packed = zlib.compress(raw) if compress else raw
        return kind.encode() + struct.pack("<III", len(value), int(compress), len(packed)) + packed
    if isinstance(value, int):
        return b"L" + struct.pack("<q", value)
    if isinstance(value, float):
        return b"D" + struct.pack("<d", value)
    text = value.encode() if isinstance(value, str) else value.name.encode() + b"\0\1" + value.kind.encode()
    return b"S" + struct.pack("<I", len(text)) + text
