"""Container of glTF 2.0 assets (Khronos, glTF 2.0 specification, 4 and 5): GLB, or JSON with embedded buffers."""

from __future__ import annotations

import base64
import binascii
import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from bunraku.motion.errors import UnreadableFile, quote_excerpt
from bunraku.motion.rotation import Array

GLB_MAGIC = b"glTF"
MAX_JSON_ITEMS = 1_000_000
"""Members and elements of the JSON part; a motion of an hour has a few thousand."""
MAX_VALUES = 32_000_000
"""Numbers of all accessors that are read together: twice those of a file of 64 MiB, as accessors may share data."""

_HEADER = struct.Struct("<4sII")
_CHUNK = struct.Struct("<I4s")
_COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_DTYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_INDEX_DTYPES = {code: _DTYPES[code] for code in (5121, 5123, 5125)}
_Value = TypeVar("_Value")
_REEXPORT = "export the file again, as GLB"
_DATA_URI = "data:"


@dataclass(slots=True)
class GltfFile:
    """JSON part of an asset and its first binary chunk, if it is a GLB file."""

    document: dict[str, Any]
    binary: bytes
    _items: dict[str, list[dict[str, Any]]] = field(default_factory=dict)
    _buffers: dict[int, bytes] = field(default_factory=dict)
    _values_read: int = 0

    def items(self, name: str) -> list[dict[str, Any]]:
        """Return the objects of an array at the top, empty if there is none."""
        if name not in self._items:
            self._items[name] = check_objects(self.document.get(name, []), name)
        return self._items[name]

    def item(self, name: str, index: object) -> dict[str, Any]:
        """Return one object of an array at the top."""
        return self.items(name)[self.check_index(name, index)]

    def check_index(self, name: str, index: object) -> int:
        """Return `index` if the array `name` at the top has it."""
        return check_index(index, self.items(name), name)

    def read_accessor(self, index: object, components: int) -> Array:
        """Return the values (n, `components`) of an accessor; normalised integers become -1..1 or 0..1."""
        accessor = self.item("accessors", index)
        where = f"accessors[{index}]"
        count, dtype = accessor.get("count"), _look_up(_DTYPES, accessor.get("componentType"))
        if _look_up(_COMPONENTS, accessor.get("type")) != components or dtype is None:
            raise broken(where, f"it has no elements of {components} numbers")
        if isinstance(count, bool) or not isinstance(count, int) or not 0 < count <= MAX_VALUES // components:
            raise broken(where, f"count is {quote_excerpt(str(count))}")
        self._values_read += count * components
        if self._values_read > MAX_VALUES:
            raise UnreadableFile(
                "Too much motion", f"over {MAX_VALUES:,} numbers", field=where, hint="cut it into shorter animations"
            )
        if "bufferView" in accessor:
            values = self._read_view(accessor, np.dtype(dtype), count, components, where)
        else:
            values = np.zeros((count, components), dtype)
        if "sparse" in accessor:
            values = self._replace_sparse(accessor["sparse"], values, f"{where}.sparse")
        if accessor.get("normalized") is True and values.dtype.kind != "f":
            scaled = values / float(np.iinfo(values.dtype).max)
            return np.maximum(scaled, -1.0)
        return values.astype(np.float64)

    def read_image(self, index: object) -> bytes:
        """Return the bytes of an image, encoded as in the file."""
        image = self.item("images", index)
        where = f"images[{index}]"
        if "bufferView" not in image:
            return _decode_uri(image.get("uri"), where)
        view = self.item("bufferViews", image["bufferView"])
        buffer = self._read_buffer(view.get("buffer", 0))
        start, length = _whole(view, "byteOffset", 0, where), _whole(view, "byteLength", 0, where)
        if start + length > len(buffer):
            raise broken(where, f"its {length} bytes reach beyond its data")
        return buffer[start : start + length]

    def find_parents(self) -> list[int]:
        """Return the parent of each node, -1 for roots; raise `UnreadableFile` unless they are a tree."""
        items = self.items("nodes")
        parents = [-1] * len(items)
        for index, item in enumerate(items):
            children = item.get("children", [])
            if not isinstance(children, list):
                raise broken(f"nodes[{index}]", "children is no list")
            for child in children:
                number = self.check_index("nodes", child)
                if parents[number] >= 0:
                    raise broken(f"nodes[{number}]", "it has two parents")
                parents[number] = index
        _check_tree(parents)
        return parents

    def _replace_sparse(self, sparse: object, values: np.ndarray[Any, Any], where: str) -> np.ndarray[Any, Any]:
        """Return `values` with those of a sparse accessor in their places (glTF 2.0, 3.6.2.3)."""
        if not isinstance(sparse, dict):
            raise broken(where, "it is no object")
        count = sparse.get("count")
        if isinstance(count, bool) or not isinstance(count, int) or not 0 < count <= len(values):
            raise broken(where, f"count is {quote_excerpt(str(count))}, of {len(values)} elements")
        parts: list[dict[str, Any]] = []
        for name in ("indices", "values"):
            part = sparse.get(name)
            if not isinstance(part, dict) or "bufferView" not in part:
                raise broken(f"{where}.{name}", "it has no bufferView")
            parts.append(part)
        index_type = _look_up(_INDEX_DTYPES, parts[0].get("componentType"))
        if index_type is None:
            raise broken(f"{where}.indices", "its componentType is none of indices")
        indices = self._read_view(parts[0], np.dtype(index_type), count, 1, f"{where}.indices")[:, 0].astype(np.int64)
        if (np.diff(indices) <= 0).any() or indices[-1] >= len(values):
            raise broken(f"{where}.indices", f"they do not ascend below {len(values)}")
        replaced = values.copy()
        replaced[indices] = self._read_view(parts[1], values.dtype, count, values.shape[1], f"{where}.values")
        return replaced

    def _read_view(
        self, accessor: dict[str, Any], dtype: np.dtype[Any], count: int, components: int, place: str
    ) -> np.ndarray[Any, Any]:
        """Return the values (n, `components`) of an accessor, or a part of one, at `place` as they are stored."""
        view = self.item("bufferViews", accessor["bufferView"])
        where = f"bufferViews[{accessor['bufferView']}]"
        if "EXT_meshopt_compression" in view.get("extensions", {}):
            raise UnreadableFile(
                "Compressed file",
                "its data is compressed with EXT_meshopt_compression",
                field=where,
                hint="export it without compression (gltfpack: -noq, without -c)",
            )
        buffer = self._read_buffer(view.get("buffer", 0))
        width = components * dtype.itemsize
        start, length, stride = (
            _whole(view, "byteOffset", 0, where),
            _whole(view, "byteLength", 0, where),
            _whole(view, "byteStride", width, where),
        )
        offset = _whole(accessor, "byteOffset", 0, place)
        if stride < width or start + length > len(buffer) or offset + (count - 1) * stride + width > length:
            raise broken(where, f"{count} elements of {width} bytes reach beyond its data")
        raw = np.frombuffer(buffer, np.uint8, (count - 1) * stride + width, start + offset)
        rows = np.lib.stride_tricks.as_strided(raw, (count, width), (stride, 1), writeable=False)
        return np.ascontiguousarray(rows).view(dtype)

    def _read_buffer(self, index: object) -> bytes:
        number = self.check_index("buffers", index)
        uri = self.item("buffers", number).get("uri")
        if uri is None:
            return self.binary
        if number not in self._buffers:
            self._buffers[number] = _decode_uri(uri, f"buffers[{index}]")
        return self._buffers[number]


def parse_gltf_file(data: bytes) -> GltfFile:
    """Parse a GLB file, or a glTF file in JSON. Raises `UnreadableFile`."""
    text, binary = (data, b"") if not data.startswith(GLB_MAGIC) else _split_chunks(data)
    if text.count(b",") + text.count(b"[") + text.count(b"{") > MAX_JSON_ITEMS:
        raise UnreadableFile(
            "Too large",
            f"its JSON part has over {MAX_JSON_ITEMS:,} items",
            hint="export the skeleton and its motion only",
        )
    try:
        document = json.loads(text.decode("utf-8-sig"))
    except (UnicodeDecodeError, ValueError, RecursionError) as error:
        line = error.lineno if isinstance(error, json.JSONDecodeError) else None
        raise UnreadableFile("Not a glTF file", "its JSON part is broken", line=line, hint=_REEXPORT) from error
    asset = document.get("asset") if isinstance(document, dict) else None
    version = asset.get("version") if isinstance(asset, dict) else None
    if not isinstance(version, str) or not version.startswith("2."):
        raise UnreadableFile(
            "Not a glTF 2 file", f"its version is {quote_excerpt(str(version))}", field="asset.version", hint=_REEXPORT
        )
    return GltfFile(document, binary)


def _split_chunks(data: bytes) -> tuple[bytes, bytes]:
    """Return the JSON and binary chunks of a GLB file."""
    if len(data) < _HEADER.size + _CHUNK.size:
        raise UnreadableFile("Cut short", "the file ends in its header", hint=_REEXPORT)
    _, version, length = _HEADER.unpack_from(data)
    if version != 2:
        raise UnreadableFile("Not a glTF 2 file", f"its version is {version}", hint=_REEXPORT)
    if length > len(data):
        raise UnreadableFile(
            "Cut short", f"the file says it has {length:,} bytes, but {len(data):,} are there", hint="send it again"
        )
    chunks: dict[bytes, bytes] = {}
    position = _HEADER.size
    while position + _CHUNK.size <= length:
        size, kind = _CHUNK.unpack_from(data, position)
        position += _CHUNK.size
        if position + size > length:
            raise broken("chunks", "a chunk reaches beyond the file")
        chunks.setdefault(kind, data[position : position + size])
        position += size + -size % 4
    if b"JSON" not in chunks:
        raise broken("chunks", "there is no JSON chunk")
    return chunks[b"JSON"], chunks.get(b"BIN\0", b"")


def read_numbers(value: object, count: int, where: str, name: str) -> Array:
    """Return `value`, called `name`, if it is a list of `count` numbers."""
    numbers = value if isinstance(value, list) and len(value) == count else []
    if not numbers or not all(isinstance(each, int | float) and abs(each) < 1e30 for each in numbers):
        raise broken(where, f"its {name} is not {count} numbers")
    return np.array(numbers, dtype=np.float64)


def check_objects(value: object, name: str) -> list[dict[str, Any]]:
    """Return `value` if it is a list of objects."""
    if not isinstance(value, list) or not all(isinstance(item, dict) for item in value):
        raise broken(name, "it is no list of objects")
    return value


def check_index(index: object, items: list[Any], name: str) -> int:
    """Return `index` if the array `items` has it."""
    if isinstance(index, bool) or not isinstance(index, int) or not 0 <= index < len(items):
        raise broken(name, f"there is no number {quote_excerpt(str(index))}")
    return index


def _look_up(table: Mapping[Any, _Value], key: object) -> _Value | None:
    """Return the value of a key that a file gives, None if there is none; it may be of any type of JSON."""
    return table.get(key) if isinstance(key, int | str) else None


def broken(field: str, detail: str) -> UnreadableFile:
    """Return the error of an asset that contradicts the specification."""
    return UnreadableFile("Broken glTF file", detail, field=field, hint=_REEXPORT)


def _decode_uri(uri: object, where: str) -> bytes:
    """Return the data in a data URI (RFC 2397)."""
    if not isinstance(uri, str) or not uri.startswith(_DATA_URI):
        raise UnreadableFile(
            "Not one file",
            f"its data is in another file, {quote_excerpt(str(uri))}",
            field=where,
            hint="export it as GLB, or with embedded buffers",
        )
    try:
        return base64.b64decode(uri.partition(",")[2], validate=True)
    except binascii.Error as error:
        raise broken(where, "its data is not Base64") from error


def _check_tree(parents: list[int]) -> None:
    """Raise `UnreadableFile` if a node is its own ancestor."""
    state = [0] * len(parents)
    for start in range(len(parents)):
        index, path = start, []
        while index >= 0 and state[index] == 0:
            state[index] = 1
            path.append(index)
            index = parents[index]
        if index >= 0 and state[index] == 1:
            raise broken(f"nodes[{index}]", "it lies inside itself")
        for passed in path:
            state[passed] = 2


def _whole(item: dict[str, Any], name: str, default: int, where: str) -> int:
    value = item.get(name, default)
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 1 << 32:
        raise broken(where, f"{name} is {quote_excerpt(str(value))}")
    return value
