from __future__ import annotations

import base64
import json
import struct

import numpy as np
import pytest

from bunraku.motion.errors import UnreadableFile
from bunraku.motion.readers.gltf_file import GltfFile, parse_gltf_file
from tests.motion.readers.sources import pack_glb

ASSET = {"asset": {"version": "2.0"}}


def test_binary_and_text_files_have_the_same_content() -> None:
    data = bytes(range(12))
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    views = {"accessors": [{"bufferView": 0, "componentType": 5121, "count": 4, "type": "VEC3"}]}
    views |= {"bufferViews": [{"buffer": 0, "byteLength": 12}]}
    glb = parse_gltf_file(pack_glb({**ASSET, **views, "buffers": [{"byteLength": 12}]}, data))
    text = parse_gltf_file(json.dumps({**ASSET, **views, "buffers": [{"byteLength": 12, "uri": uri}]}).encode())
    for file in (glb, text):
        assert file.read_accessor(0, 3).tolist() == np.arange(12.0).reshape(4, 3).tolist()


@pytest.mark.parametrize(
    ("kind", "code", "values", "expected"),
    [
        ("b", 5120, (-128, 127), (-1.0, 1.0)),
        ("B", 5121, (0, 255), (0.0, 1.0)),
        ("h", 5122, (-32767, 0), (-1.0, 0.0)),
        ("H", 5123, (0, 65535), (0.0, 1.0)),
    ],
)
def test_normalised_integers_are_scaled(
    kind: str, code: int, values: tuple[int, int], expected: tuple[float, float]
) -> None:
    data = struct.pack(f"<2{kind}", *values)
    document = {
        "accessors": [{"bufferView": 0, "componentType": code, "count": 2, "type": "SCALAR", "normalized": True}],
        "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
        "buffers": [{"byteLength": len(data)}],
    }
    assert GltfFile(document, data).read_accessor(0, 1)[:, 0].tolist() == pytest.approx(expected, abs=1e-6)


def test_strides_are_skipped() -> None:
    data = struct.pack("<6f", *range(6))
    document = {
        "accessors": [{"bufferView": 0, "byteOffset": 4, "componentType": 5126, "count": 3, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": 24, "byteStride": 8}],
        "buffers": [{"byteLength": 24}],
    }
    assert GltfFile(document, data).read_accessor(0, 1)[:, 0].tolist() == [1.0, 3.0, 5.0]


@pytest.mark.parametrize(
    ("data", "title"),
    [
        (b"glTF\2\0", "Cut short"),
        (struct.pack("<4sII", b"glTF", 2, 1000) + bytes(20), "Cut short"),
        (struct.pack("<4sII", b"glTF", 1, 20) + bytes(20), "Not a glTF 2 file"),
        (struct.pack("<4sIII4s", b"glTF", 2, 20, 50, b"JSON"), "Broken glTF file"),
        (struct.pack("<4sIII4s", b"glTF", 2, 20, 0, b"BIN\0"), "Broken glTF file"),
        (b"{" * 100_000, "Not a glTF file"),
        (b'{"a": ' + b"[" * 100_000, "Not a glTF file"),
        (b"{" + b"[]," * 600_000, "Too large"),
        (b'{"asset":\n{"version": 2.0 x', "Not a glTF file"),
        (b"\xff{}", "Not a glTF file"),
        (b"[]", "Not a glTF 2 file"),
    ],
)
def test_broken_containers_are_refused_with_a_hint(data: bytes, title: str) -> None:
    with pytest.raises(UnreadableFile) as caught:
        parse_gltf_file(data)
    assert caught.value.title == title
    assert caught.value.hint


def test_line_of_broken_json_is_named() -> None:
    with pytest.raises(UnreadableFile) as caught:
        parse_gltf_file(b'{"asset":\n{"version"}}')
    assert caught.value.line == 2
