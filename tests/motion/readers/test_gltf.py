from __future__ import annotations

import copy
import struct
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from bunraku.motion.analysis import analyse
from bunraku.motion.errors import UnreadableFile
from bunraku.motion.readers import bvh
from bunraku.motion.readers.gltf import parse_gltf
from tests.motion.readers.sources import pack_glb, unpack_glb, write_glb
from tests.motion.synthetic_motion import export_bvh, smooth_motion

SOURCE = bvh.parse_bvh(export_bvh(smooth_motion(frames=12)))
DOCUMENT, BINARY = unpack_glb(write_glb(SOURCE))


def edited(change: Callable[[dict[str, Any]], object]) -> bytes:
    """Return a valid file whose document was changed."""
    document = copy.deepcopy(DOCUMENT)
    change(document)
    return pack_glb(document, BINARY)


def test_animation_is_chosen_by_name_or_size() -> None:
    data = write_glb(SOURCE, animations=("idle", "dance"))
    assert parse_gltf(data).notes == ("Of 2 takes, 'idle' was read; the others are 'dance'.",)
    chosen = parse_gltf(data, "dance")
    assert chosen.notes == ("Of 2 takes, 'dance' was read; the others are 'idle'.",)
    # the root is left out of the second animation
    assert np.ptp(chosen.world_transforms([0, 1])[0][:, 1], axis=0).max() == 0.0
    with pytest.raises(UnreadableFile, match="No such take") as caught:
        parse_gltf(data, "jump")
    assert "'idle', 'dance'" in caught.value.hint


def test_several_roots_are_put_below_one() -> None:
    motion = parse_gltf(edited(lambda document: document["nodes"][-1].pop("children")))
    assert motion.parents[:2] == (-1, 0)

    def add_prop(document: dict[str, Any]) -> None:
        document["nodes"].append({"name": "prop"})
        target = {"node": len(document["nodes"]) - 1, "path": "rotation"}
        document["animations"][0]["channels"].append({"sampler": 0, "target": target})

    other = parse_gltf(edited(add_prop))
    assert (other.names[0], other.parents.count(-1)) == ("scene", 1)
    assert analyse(other).source_joints["l_knee"] == "l_knee"


def test_nodes_without_motion_are_left_out() -> None:
    data = edited(lambda document: document["nodes"].append({"name": "lamp"}))
    assert "lamp" not in parse_gltf(data).names


def test_matrices_are_read_as_transforms() -> None:
    def to_matrix(document: dict[str, Any]) -> None:
        armature = document["nodes"][-1]
        del armature["scale"]
        # a quarter turn about y, and a scale of 2
        armature["matrix"] = [0, 0, -2, 0, 0, 2, 0, 0, 2, 0, 0, 0, 5, 0, 0, 1]

    plain, turned = parse_gltf(write_glb(SOURCE)), parse_gltf(edited(to_matrix))
    positions, expected = turned.world_transforms([3])[0][:, 3], plain.world_transforms([3])[0][:, 3]
    np.testing.assert_allclose(positions[:, 0], 2.0 * expected[:, 2] + 5.0, atol=1e-4)
    np.testing.assert_allclose(positions[:, 2], -2.0 * expected[:, 0], atol=1e-4)


def set_path(*path: str | int, value: object) -> Callable[[dict[str, Any]], object]:
    def change(document: dict[str, Any]) -> None:
        target: Any = document
        for key in path[:-1]:
            target = target[key]
        target[path[-1]] = value

    return change


@pytest.mark.parametrize(
    ("change", "title"),
    [
        (set_path("animations", value=[]), "No animation"),
        (set_path("animations", value={}), "Broken glTF file"),
        (set_path("animations", 0, "channels", value=[]), "Nothing moves"),
        (set_path("animations", 0, "channels", 0, "sampler", value=99), "Broken glTF file"),
        (set_path("animations", 0, "channels", 0, "sampler", value=True), "Broken glTF file"),
        (set_path("animations", 0, "channels", 0, "target", "node", value=-1), "Broken glTF file"),
        (set_path("animations", 0, "samplers", 0, "interpolation", value="SMOOTH"), "Broken glTF file"),
        (set_path("animations", 0, "samplers", 0, "input", value=None), "Broken glTF file"),
        (set_path("animations", 0, "samplers", 0, "output", value=0), "Broken glTF file"),
        (set_path("accessors", 1, "count", value=5), "Broken glTF file"),
        (set_path("accessors", 1, "count", value=10**9), "Broken glTF file"),
        (set_path("accessors", 1, "componentType", value=5130), "Broken glTF file"),
        (set_path("accessors", 1, "componentType", value=[]), "Broken glTF file"),
        (set_path("accessors", 1, "type", value=[]), "Broken glTF file"),
        (set_path("accessors", 1, "sparse", value={}), "Broken glTF file"),
        (set_path("accessors", 1, "byteOffset", value=4), "Broken glTF file"),
        (set_path("bufferViews", 1, "byteOffset", value=10**8), "Broken glTF file"),
        (set_path("bufferViews", 1, "byteStride", value=1), "Broken glTF file"),
        (set_path("bufferViews", 1, "buffer", value=3), "Broken glTF file"),
        (set_path("bufferViews", 1, "extensions", value={"EXT_meshopt_compression": {}}), "Compressed file"),
        (set_path("buffers", 0, "uri", value="motion.bin"), "Not one file"),
        (set_path("buffers", 0, "uri", value="data:application/octet-stream;base64,?"), "Broken glTF file"),
        (set_path("nodes", 0, "children", value=[0]), "Broken glTF file"),
        (set_path("nodes", 0, "children", value=[len(DOCUMENT["nodes"]) - 1]), "Broken glTF file"),
        (set_path("nodes", 0, "children", value=5), "Broken glTF file"),
        (set_path("nodes", 0, "translation", value=[1, 2]), "Broken glTF file"),
        (set_path("nodes", 0, "rotation", value=[0, 0, 0, 0]), "Broken glTF file"),
        (set_path("nodes", 0, "matrix", value=[0] * 16), "Broken glTF file"),
        (set_path("skins", value=[{"joints": [999]}]), "Broken glTF file"),
        (set_path("skins", value=[{"joints": 1}]), "Broken glTF file"),
        (set_path("asset", "version", value="1.0"), "Not a glTF 2 file"),
        (set_path("asset", value=1), "Not a glTF 2 file"),
    ],
)
def test_broken_documents_are_refused_with_field_and_hint(change: Callable[[Any], object], title: str) -> None:
    with pytest.raises(UnreadableFile) as caught:
        parse_gltf(edited(change))
    assert caught.value.title == title
    assert caught.value.hint or caught.value.field


@pytest.mark.parametrize(("times", "title"), [([0.0, -1.0], "Broken glTF file"), ([0.0, 1e5], "Too much motion")])
def test_times_are_checked(times: list[float], title: str) -> None:
    binary = bytearray(BINARY)
    struct.pack_into("<2f", binary, 0, *times)
    document = copy.deepcopy(DOCUMENT)
    for accessor in document["accessors"]:
        accessor["count"] = 2
    with pytest.raises(UnreadableFile) as caught:
        parse_gltf(pack_glb(document, bytes(binary)))
    assert caught.value.title == title


def test_values_that_are_no_numbers_are_refused() -> None:
    binary = bytearray(BINARY)
    struct.pack_into("<f", binary, DOCUMENT["bufferViews"][1]["byteOffset"], float("nan"))
    with pytest.raises(UnreadableFile, match="no numbers"):
        parse_gltf(pack_glb(DOCUMENT, bytes(binary)))


def test_channels_whose_property_is_no_word_are_skipped() -> None:
    document = copy.deepcopy(DOCUMENT)
    document["animations"][0]["channels"][1]["target"]["path"] = ["rotation"]
    assert parse_gltf(pack_glb(document, BINARY)).frame_count == SOURCE.frame_count
