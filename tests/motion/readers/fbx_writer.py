"""Writer of small FBX files in ASCII (version 7.4), for tests of the reader."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.readers.bvh import parse_bvh
from bunraku.motion.rotation import Array
from bunraku.motion.source_motion import SourceMotion
from tests.motion.readers.sources import local_transforms
from tests.motion.synthetic_motion import export_bvh, smooth_motion

TICKS_PER_SECOND = 46_186_158_000
ORDERS = ("XYZ", "XZY", "YZX", "YXZ", "ZXY", "ZYX")
"""Orders of rotation by their number in the file; the first axis is applied first."""


def write_fbx(
    source: SourceMotion | None = None,
    *,
    takes: Sequence[str] = ("dance",),
    pre_rotation: tuple[float, float, float] = (0.0, 0.0, 0.0),
    order: str = "XYZ",
    units_per_metre: float = 100.0,
) -> bytes:
    """Return `source`, by default a dance of 20 frames; later takes move fewer joints."""
    source = source or parse_bvh(export_bvh(smooth_motion(frames=20), units_per_metre=units_per_metre))
    offsets, turns = local_transforms(source)
    before = _from_degrees(np.array(pre_rotation), "XYZ")
    degrees = to_degrees(rotation.multiply(rotation.conjugate(before), turns), order)
    rest = source.rest_positions
    objects: list[str] = []
    connections: list[str] = []
    for joint, name in enumerate(source.names):
        parent = source.parents[joint]
        place = rest[joint] - rest[parent] if parent >= 0 else offsets[0, 0]
        objects.append(
            f'Model: {100 + joint}, "Model::{name}", "LimbNode" {{\nVersion: 232\nProperties70: {{\n'
            f'P: "RotationActive", "bool", "", "",1\n'
            f'P: "RotationOrder", "enum", "", "",{ORDERS.index(order)}\n'
            f'P: "PreRotation", "Vector3D", "Vector", "",{_list(pre_rotation)}\n'
            f'P: "Lcl Translation", "Lcl Translation", "", "A",{_list(place)}\n'
            f'P: "Lcl Rotation", "Lcl Rotation", "", "A",{_list(_rest_degrees(before, order))}\n}}\n}}'
        )
        objects.append(f'NodeAttribute: {300 + joint}, "NodeAttribute::", "LimbNode" {{\nTypeFlags: "Skeleton"\n}}')
        connections += [f"{100 + joint},{100 + parent if parent >= 0 else 0}", f"{300 + joint},{100 + joint}"]
    times = [round(frame * TICKS_PER_SECOND / source.fps) for frame in range(len(turns))]
    lines = [f'C: "OO",{pair}' for pair in connections]
    for number, take in enumerate(takes):
        base = 10_000 * (number + 1)
        objects.append(
            f'AnimationStack: {base}, "AnimStack::{take}", "" {{\nProperties70: {{\n'
            f'P: "LocalStop", "KTime", "Time", "",{times[-1]}\n}}\n}}'
        )
        objects.append(f'AnimationLayer: {base + 1}, "AnimLayer::BaseLayer", "" {{\n}}')
        lines.append(f'C: "OO",{base + 1},{base}')
        for joint in range(number, len(source.names)):
            tracks = [("R", "Lcl Rotation", degrees[:, joint])]
            if joint == 0:
                tracks.append(("T", "Lcl Translation", offsets[:, 0]))
            for kind, (letter, prop, values) in enumerate(tracks):
                node = base + 100 + 10 * joint + 5 * kind
                objects.append(f'AnimationCurveNode: {node}, "AnimCurveNode::{letter}", "" {{\n}}')
                lines += [f'C: "OO",{node},{base + 1}', f'C: "OP",{node},{100 + joint}, "{prop}"']
                for axis in range(3):
                    objects.append(_curve(node + 1 + axis, times, values[:, axis]))
                    lines.append(f'C: "OP",{node + 1 + axis},{node}, "d|{"XYZ"[axis]}"')
    header = "; FBX 7.4.0 project file\nFBXHeaderExtension: {\nFBXHeaderVersion: 1003\nFBXVersion: 7400\n}\n"
    body = "\n".join(objects)
    return f"{header}Objects: {{\n{body}\n}}\nConnections: {{\n{chr(10).join(lines)}\n}}\n".encode()


def _curve(number: int, times: Sequence[int], values: Array) -> str:
    count = len(times)
    return (
        f'AnimationCurve: {number}, "AnimCurve::", "" {{\nKeyVer: 4008\n'
        f"KeyTime: *{count} {{\na: {_list(times)}\n}}\nKeyValueFloat: *{count} {{\na: {_list(values)}\n}}\n"
        f"KeyAttrFlags: *1 {{\na: 4\n}}\nKeyAttrDataFloat: *4 {{\na: 0,0,0,0\n}}\n"
        f"KeyAttrRefCount: *1 {{\na: {count}\n}}\n}}"
    )


def _list(values: Array | Sequence[float]) -> str:
    return ",".join(
        f"{value:.10g}" if isinstance(value, float) else str(value) for value in np.asarray(values).tolist()
    )


def _from_degrees(degrees: Array, order: str) -> Array:
    turn = rotation.IDENTITY
    for name in order:
        axis = "XYZ".index(name)
        turn = rotation.multiply(rotation.from_coordinate_axis(axis, np.radians(degrees[axis])), turn)
    return turn


def _rest_degrees(before: Array, order: str) -> Array:
    degrees: Array = to_degrees(rotation.conjugate(before)[None, None], order)[0, 0]
    return degrees


def to_degrees(turns: Array, order: str) -> Array:
    """Return angles (n, J, 3) about x, y and z, whose rotations in `order`, the first axis first, give `turns`."""
    matrix = rotation.to_matrix(turns)
    first, second, third = ("XYZ".index(name) for name in order)
    sign = 1.0 if (first, second, third) in ((0, 1, 2), (1, 2, 0), (2, 0, 1)) else -1.0
    angles = np.empty((*turns.shape[:-1], 3))
    angles[..., second] = np.arcsin(np.clip(-sign * matrix[..., third, first], -1.0, 1.0))
    angles[..., first] = np.arctan2(sign * matrix[..., third, second], matrix[..., third, third])
    angles[..., third] = np.arctan2(sign * matrix[..., second, first], matrix[..., first, first])
    unwrapped: Array = np.degrees(np.unwrap(angles, axis=0))
    return unwrapped
