"""Fuzzing targets: the readers of motion files, and invariants of every motion that they return.

A target returns True if it accepts a file and False if it rejects it with `UnreadableMotion`. Any other exception is a
failure. The reader of FBX is a compiled library that can end the process: its target is for a separate process.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bunraku.motion.errors import UnreadableMotion
from bunraku.motion.readers.acclaim import parse_amc, parse_asf
from bunraku.motion.readers.bvh import parse_bvh
from bunraku.motion.readers.gltf import parse_gltf
from bunraku.motion.readers.motion_file import read_motion
from bunraku.motion.source_motion import SourceMotion
from tests.motion.readers.fbx_tree import MAGIC, to_binary
from tests.motion.readers.fbx_writer import build_fbx, write_fbx
from tests.motion.readers.sources import pack_glb, unpack_glb, write_acclaim, write_glb, write_zip
from tests.motion.synthetic_motion import export_bvh, smooth_motion

MAX_FRAMES = 300
"""Frames whose transforms are computed: sparse keys may stand for many."""
SEPARATOR = b"\0AMC\0"
"""Between the ASF and the AMC in an input of `acclaim`."""


def check_motion(motion: SourceMotion) -> None:
    """Assert that a motion is consistent and finite."""
    count = len(motion.names)
    assert len(motion.parents) == len(motion.joint_lines) == count
    assert all(parent < joint for joint, parent in enumerate(motion.parents))
    assert motion.parents.count(-1) == 1
    assert motion.rest_positions.shape == (count, 3)
    assert motion.rest_orientations.shape == (count, 4)
    assert 0.0 < motion.fps < 1e6
    assert motion.frame_count > 0
    frames = np.arange(min(motion.frame_count, MAX_FRAMES))
    with np.errstate(all="ignore"):
        positions, orientations = motion.world_transforms([count - 1], frames)
    assert positions.shape == (len(frames), count, 3)
    assert orientations.shape == (len(frames), count, 4)


def _accepts(read: Callable[[bytes], SourceMotion], data: bytes) -> bool:
    try:
        motion = read(data)
    except UnreadableMotion:
        return False
    check_motion(motion)
    return True


def bvh(data: bytes) -> bool:
    """Read a BVH file."""
    return _accepts(parse_bvh, data)


def gltf(data: bytes) -> bool:
    """Read a glTF file."""
    return _accepts(parse_gltf, data)


def acclaim(data: bytes) -> bool:
    """Read an ASF and an AMC file."""
    asf, _, amc = data.partition(SEPARATOR)
    return _accepts(lambda _: parse_amc(amc, parse_asf(asf)), data)


def archive(data: bytes) -> bool:
    """Read a zip archive, or whatever it has become."""
    return _accepts(read_motion, data)


def fbx(data: bytes) -> bool:
    """Read an FBX file."""
    return _accepts(read_motion, data if data.startswith(MAGIC) else b"; FBX 7.4.0\n" + data)


TARGETS: list[Callable[[bytes], bool]] = [bvh, gltf, acclaim, archive]

DICTIONARY = ["JOINT", "End Site", "CHANNELS", "OFFSET", "MOTION", "Frames:", ":hierarchy", ":bonedata", "dof", "begin"]
DICTIONARY += ["accessors", "bufferViews", "animations", "children", "sampler", "VEC4", "CUBICSPLINE", "glTF", "JSON"]
"""Words of libFuzzer, for texts."""


def load_seeds() -> list[tuple[int, bytes]]:
    """Return pairs of the number of a target and a file that it accepts."""
    clip = export_bvh(smooth_motion(frames=3))
    source = parse_bvh(clip)
    glb = write_glb(source, scale=0.01)
    document, binary = unpack_glb(glb)
    document["nodes"][0]["rotation"] = [0, 0, 0, 1]
    document["skins"] = [{"joints": [0, 1, 2]}]
    asf, amc = write_acclaim(source, source.names)
    return [
        (0, clip),
        (1, glb),
        (1, pack_glb(document, binary)),
        (1, write_sparse_glb(source)),
        (2, asf + SEPARATOR + amc),
        (3, write_zip({"a.bvh": clip})),
        (3, write_zip({"03.asf": asf, "03_01.amc": amc})),
        (3, write_zip({"a.glb": glb, "b.txt": b"x"})),
    ]


def write_sparse_glb(source: SourceMotion) -> bytes:
    """Return a file whose first rotations are a sparse accessor."""
    document, binary = unpack_glb(write_glb(source))
    view = document["accessors"][1]["bufferView"]
    document["bufferViews"].append({"buffer": 0, "byteOffset": len(binary), "byteLength": 2})
    document["accessors"][1]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": len(document["bufferViews"]) - 1, "componentType": 5123},
        "values": {"bufferView": view},
    }
    return pack_glb(document, binary + b"\1\0")


def load_fbx_seeds() -> list[bytes]:
    """Return files that `fbx` accepts: in ASCII, and in binary with offsets of 32 and of 64 bits."""
    tree = build_fbx(parse_bvh(export_bvh(smooth_motion(frames=5))), pre_rotation=(10.0, 20.0, 30.0))
    return [write_fbx(), to_binary(tree, 7400), to_binary(tree, 7700, compress=True)]
