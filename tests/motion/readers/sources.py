"""Files of several formats that have the motion of a BVH file, for tests of the readers."""

from __future__ import annotations

import io
import json
import struct
import zipfile
from typing import Any

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.source_motion import SourceMotion


def local_transforms(source: SourceMotion) -> tuple[Array, Array]:
    """Return offsets (n, J, 3) and rotations (n, J, 4) relative to the parents."""
    positions, orientations = source.world_transforms(list(range(len(source.names))))
    offsets, turns = positions.copy(), orientations.copy()
    for joint, parent in enumerate(source.parents):
        if parent >= 0:
            back = rotation.conjugate(orientations[:, parent])
            offsets[:, joint] = rotation.rotate(back, positions[:, joint] - positions[:, parent])
            turns[:, joint] = rotation.multiply(back, orientations[:, joint])
    return offsets, turns


def write_glb(
    source: SourceMotion,
    names: tuple[str, ...] | None = None,
    *,
    scale: float = 1.0,
    animations: tuple[str, ...] = ("dance",),
    extensions: dict[str, Any] | None = None,
) -> bytes:
    """Write `source` as GLB below an armature of `scale`, each animation with one joint more left out."""
    offsets, turns = local_transforms(source)
    binary = bytearray()
    document: dict[str, Any] = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [len(source.names)]}]}
    views: list[dict[str, int]] = []
    accessors: list[dict[str, Any]] = []

    def add(values: Array, kind: str) -> int:
        data = np.asarray(values, "<f4").tobytes()
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(data)})
        accessors.append({"bufferView": len(views) - 1, "componentType": 5126, "count": len(values), "type": kind})
        binary.extend(data)
        return len(accessors) - 1

    times = add(np.arange(len(offsets)) / source.fps, "SCALAR")
    rest = source.rest_positions
    nodes: list[dict[str, Any]] = []
    for joint, parent in enumerate(source.parents):
        at_rest = rest[joint] - rest[parent] if parent >= 0 else offsets[0, joint]
        node: dict[str, Any] = {"name": (names or source.names)[joint], "translation": (at_rest / scale).tolist()}
        if children := [child for child, above in enumerate(source.parents) if above == joint]:
            node["children"] = children
        nodes.append(node)
    nodes.append({"name": "Armature", "children": [0], "scale": [scale] * 3})
    made = []
    for left_out, name in enumerate(animations):
        samplers: list[dict[str, int]] = []
        channels: list[dict[str, Any]] = []
        for joint in range(left_out, len(source.names)):
            tracks = [("rotation", turns[:, joint][:, [1, 2, 3, 0]], "VEC4")]
            if np.ptp(offsets[:, joint], axis=0).max() > 1e-9:
                tracks.append(("translation", offsets[:, joint] / scale, "VEC3"))
            for path, values, kind in tracks:
                samplers.append({"input": times, "output": add(values, kind)})
                channels.append({"sampler": len(samplers) - 1, "target": {"node": joint, "path": path}})
        made.append({"name": name, "samplers": samplers, "channels": channels})
    document |= {"nodes": nodes, "animations": made, "accessors": accessors, "bufferViews": views}
    document |= {"buffers": [{"byteLength": len(binary)}], **({"extensions": extensions} if extensions else {})}
    return pack_glb(document, bytes(binary))


def pack_glb(document: dict[str, Any], binary: bytes) -> bytes:
    """Return a GLB file of a JSON document and its binary chunk."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def unpack_glb(data: bytes) -> tuple[dict[str, Any], bytes]:
    """Return document and binary chunk of a file that `pack_glb` made."""
    (size,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def write_acclaim(source: SourceMotion, names: tuple[str, ...]) -> tuple[bytes, bytes]:
    """Write `source`, at rest in the frames of the world, as ASF and AMC; joint 0 is the root.

    A bone begins at its joint and ends at the joint's first child or End Site; others are linked by bones without
    freedom that begin at the parent.
    """
    offsets, turns = local_transforms(source)
    rest = source.rest_positions
    count = len(source.names)
    bones: list[str] = []
    pairs: list[tuple[str, str]] = []
    for joint in range(1, count):
        parent = source.parents[joint]
        link, above = f"link{joint}", "root" if parent == 0 else names[parent]
        vector = rest[joint] - rest[parent]
        length = float(np.linalg.norm(vector))
        direction = vector / (length or 1.0)
        bones.append(_bone(link, direction, length))
        bones.append(_bone(names[joint], np.array([0.0, 1.0, 0.0]), 0.0, "dof rx ry rz"))
        pairs += [(above, link), (link, names[joint])]
    asf = [":version 1.10", ":name test", ":units", "  mass 1", "  length 1", "  angle deg", ":root"]
    asf += ["  order TX TY TZ RX RY RZ", "  axis XYZ", "  position 0 0 0", "  orientation 0 0 0", ":bonedata", *bones]
    asf += [":hierarchy", "  begin", *(f"  {above} {below}" for above, below in pairs), "  end"]
    amc = ["#!OML:ASF test.asf", ":FULLY-SPECIFIED", ":DEGREES"]
    for frame in range(len(offsets)):
        amc.append(str(frame + 1))
        x, y, z = offsets[frame, 0].tolist()
        amc.append(f"root {x:.9f} {y:.9f} {z:.9f} {_angles(turns[frame, 0])}")
        amc += [f"{names[joint]} {_angles(turns[frame, joint])}" for joint in range(1, count)]
    return "\n".join(asf).encode(), "\n".join(amc).encode()


def _bone(name: str, direction: Array, length: float, dof: str = "") -> str:
    x, y, z = direction.tolist()
    lines = [
        "begin",
        f"name {name}",
        f"direction {x:.9f} {y:.9f} {z:.9f}",
        f"length {length:.9f}",
        "axis 0 0 0 XYZ",
        dof,
    ]
    return "\n".join([*lines, "end"])


def _angles(turn: Array) -> str:
    """Return degrees about fixed x, then y, then z."""
    w, x, y, z = turn.tolist()
    rx = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    ry = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    rz = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return " ".join(f"{np.degrees(angle):.9f}" for angle in (rx, ry, rz))


def write_zip(files: dict[str, bytes]) -> bytes:
    """Return a zip archive of files by their paths."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return packed.getvalue()
