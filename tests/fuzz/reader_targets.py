"""Fuzzing targets: the readers of motion files and props, and invariants of what they return.

A target returns True if it accepts a file and False if it rejects it with `UnreadableFile`. Any other exception is a
failure. The reader of FBX is a compiled library that can end the process: its target is for a separate process.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from bunraku.ingest.jobs.image_file import decode_image
from bunraku.motion import rotation
from bunraku.motion.analysis import analyse
from bunraku.motion.errors import UnreadableFile
from bunraku.motion.face import face_of
from bunraku.motion.hands import CHAIN_COUNT
from bunraku.motion.naming.expression_mapping import map_expressions
from bunraku.motion.naming.finger_mapping import map_fingers
from bunraku.motion.readers.acclaim import parse_amc, parse_asf
from bunraku.motion.readers.bvh import parse_bvh
from bunraku.motion.readers.gltf import parse_gltf
from bunraku.motion.readers.motion_file import read_motion
from bunraku.motion.source_motion import SourceMotion
from bunraku.props.model_file import write_model
from bunraku.props.reader import read_prop
from bunraku.props.scene_reader import MAX_TRIANGLES
from tests.motion.extended_source import write_source_bvh
from tests.motion.hand_source import hand_source
from tests.motion.readers.faces import FaceGlb, build_face_fbx
from tests.motion.readers.fbx_tree import MAGIC, to_ascii, to_binary
from tests.motion.readers.fbx_writer import build_fbx, write_fbx
from tests.motion.readers.sources import pack_glb, unpack_glb, write_acclaim, write_glb, write_zip
from tests.motion.synthetic_motion import export_bvh, smooth_motion
from tests.props.samples import box_glb, image_file, picture_glb

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
    check_face(motion)
    check_fingers(motion, frames)


def check_face(motion: SourceMotion) -> None:
    """Assert that expressions have finite weights in all frames, and give a face."""
    assert all(weights.shape == (motion.frame_count,) for weights in motion.expressions.values())
    assert all(np.isfinite(weights).all() for weights in motion.expressions.values())
    expressions, unknown = map_expressions(motion.expressions)
    assert not set(unknown) & set(expressions)
    if expressions:
        face, values = face_of(expressions)
        assert values.shape == (motion.frame_count, -(-len(face.axes) // 3), 3)
        assert np.isfinite(values).all()


def check_fingers(motion: SourceMotion, frames: npt.NDArray[np.int64]) -> None:
    """Assert that the fingers below any joint are those of its descendants, and that a body's fingers are finite."""
    with np.errstate(all="ignore"):
        chains = map_fingers(motion.names, motion.parents, motion.rest_positions, [0, len(motion.names) // 2])
    assert len(chains) == CHAIN_COUNT
    assert all(len(set(chain.path)) == len(chain.path) for chain in chains)
    if len(frames) < MAX_FRAMES:
        # the analysis converts all frames
        with np.errstate(all="ignore"), contextlib.suppress(UnreadableFile):
            hands = analyse(motion).hands
            assert hands is None or np.isfinite(hands.values).all()


def _accepts(read: Callable[[bytes], SourceMotion], data: bytes) -> bool:
    try:
        motion = read(data)
    except UnreadableFile:
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


def prop(data: bytes) -> bool:
    """Read a prop, and check that its model fits into a file that clients read."""
    try:
        model, guessed = read_prop(data, decode_image)
    except UnreadableFile:
        return False
    count = len(model.positions)
    assert 0 < count < 1 << 16
    assert 0 < len(model.triangles) <= MAX_TRIANGLES
    assert ((model.triangles >= 0) & (model.triangles < count)).all()
    assert np.isfinite(model.positions).all()
    assert np.abs(model.normals).max() <= 1.0
    assert ((model.looks >= 0.0) & (model.looks <= 1.0)).all()
    assert np.isfinite([model.form.pitch, model.form.height, model.form.palm_offset]).all()
    assert len(guessed) <= 2
    write_model(model)
    return True


TARGETS: list[Callable[[bytes], bool]] = [bvh, gltf, acclaim, archive, prop]

DICTIONARY = ["JOINT", "End Site", "CHANNELS", "OFFSET", "MOTION", "Frames:", ":hierarchy", ":bonedata", "dof", "begin"]
DICTIONARY += ["weights", "targetNames", "VRMC_vrm_animation", "expressions", "preset", "lookAt", "Thumb", "Index"]
DICTIONARY += ["accessors", "bufferViews", "animations", "children", "sampler", "VEC4", "CUBICSPLINE", "glTF", "JSON"]
DICTIONARY += ["materials", "pbrMetallicRoughness", "baseColorTexture", "textures", "images", "COLOR_0", "doubleSided"]
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
        (1, write_face_glb(source)),
        (0, write_source_bvh(hand_source(2))),
        (2, asf + SEPARATOR + amc),
        (3, write_zip({"a.bvh": clip})),
        (4, box_glb()),
        (4, picture_glb(image_file(np.eye(8, dtype=np.uint8)[..., None].repeat(3, axis=2) * 255), doubleSided=True)),
        (3, write_zip({"03.asf": asf, "03_01.amc": amc})),
        (3, write_zip({"a.glb": glb, "b.txt": b"x"})),
    ]


def write_face_glb(source: SourceMotion) -> bytes:
    """Return a file with morph targets, expressions of a VRM model and of a VRM animation, and a gaze."""
    weights = np.linspace(0.0, 1.0, source.frame_count)
    glb = FaceGlb(write_glb(source))
    node = glb.add_morphs({"jawOpen": weights, "eye_1": weights, "eye_2": weights}, source.fps)
    glb.add_expressions({"happy": weights}, source.fps, custom={"tail": weights})
    glb.add_gaze(np.tile(rotation.IDENTITY, (source.frame_count, 1)), source.fps)
    binds = [{"node": node, "index": index, "weight": 1.0} for index in (1, 2)]
    groups = [{"presetName": "blink_l", "binds": [{"mesh": 0, "index": 1, "weight": 100}]}]
    glb.document["extensions"] |= {
        "VRMC_vrm": {"expressions": {"preset": {"blink": {"morphTargetBinds": binds}}}},
        "VRM": {"blendShapeMaster": {"blendShapeGroups": groups}},
    }
    return glb.pack()


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
    source = parse_bvh(export_bvh(smooth_motion(frames=5)))
    tree = build_fbx(source, pre_rotation=(10.0, 20.0, 30.0))
    face = build_face_fbx(source, {"jawOpen": np.linspace(0.0, 1.0, 5), "joy": np.linspace(1.0, 0.0, 5)})
    return [write_fbx(), to_binary(tree, 7400), to_binary(tree, 7700, compress=True), to_ascii(face)]
