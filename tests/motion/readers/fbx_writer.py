"""Writer of small FBX files, for tests of the reader."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from bunraku.motion import rotation
from bunraku.motion.readers.bvh import parse_bvh
from bunraku.motion.rotation import Array
from bunraku.motion.source_motion import SourceMotion
from tests.motion.readers.fbx_tree import FbxNode, ObjectName, block, leaf, to_ascii
from tests.motion.readers.sources import local_transforms
from tests.motion.synthetic_motion import export_bvh, smooth_motion

TICKS_PER_SECOND = 46_186_158_000
ORDERS = ("XYZ", "XZY", "YZX", "YXZ", "ZXY", "ZYX")
"""Orders of rotation by their number in the file; the first axis is applied first."""

CONSTANT_KEYS, LINEAR_KEYS, CUBIC_KEYS = 2, 4, 8
"""Flags of keys for their interpolation."""
MODEL_ID, ATTRIBUTE_ID, TAKE_ID = 100, 300, 10_000
"""Numbers of the objects: of the first joint, its attribute, and the first take."""
Triple = tuple[float, float, float]


def write_fbx(
    source: SourceMotion | None = None,
    *,
    takes: Sequence[str] = ("dance",),
    pre_rotation: Triple = (0.0, 0.0, 0.0),
    order: str = "XYZ",
    units_per_metre: float = 100.0,
) -> bytes:
    """Return `source`, by default a dance of 20 frames, in ASCII; later takes move fewer joints."""
    source = source or parse_bvh(export_bvh(smooth_motion(frames=20), units_per_metre=units_per_metre))
    return to_ascii(build_fbx(source, takes=takes, pre_rotation=pre_rotation, order=order))


def build_fbx(
    source: SourceMotion,
    *,
    takes: Sequence[str] = ("dance",),
    pre_rotation: Triple = (0.0, 0.0, 0.0),
    post_rotation: Triple = (0.0, 0.0, 0.0),
    order: str = "XYZ",
    settings: Mapping[str, float] | None = None,
    fps: float | None = None,
    wrap: bool = False,
    key_flags: int = LINEAR_KEYS,
) -> list[FbxNode]:
    """Return the tree of a file of `source`: each frame is a key, at `fps` if given.

    `settings` are global. Angles are continuous, or within half a turn if `wrap`.
    """
    offsets, turns = local_transforms(source)
    before, after = (_from_degrees(np.array(degrees), "XYZ") for degrees in (pre_rotation, post_rotation))
    back = rotation.conjugate(before)
    degrees = to_degrees(rotation.multiply(rotation.multiply(back, turns), after), order)
    at_rest = to_degrees(rotation.multiply(back, after)[None, None], order)[0, 0]
    if wrap:
        degrees = (degrees + 180.0) % 360.0 - 180.0
    rest = source.rest_positions
    objects: list[FbxNode] = []
    links: list[FbxNode] = []
    for joint, name in enumerate(source.names):
        parent = source.parents[joint]
        place = rest[joint] - rest[parent] if parent >= 0 else offsets[0, 0]
        properties = [
            leaf("P", "RotationActive", "bool", "", "", 1),
            leaf("P", "RotationOrder", "enum", "", "", ORDERS.index(order)),
            leaf("P", "PreRotation", "Vector3D", "Vector", "", *pre_rotation),
            leaf("P", "PostRotation", "Vector3D", "Vector", "", *post_rotation),
            leaf("P", "Lcl Translation", "Lcl Translation", "", "A", *place.tolist()),
            leaf("P", "Lcl Rotation", "Lcl Rotation", "", "A", *at_rest.tolist()),
        ]
        model = block("Model", MODEL_ID + joint, ObjectName("Model", name), "LimbNode")
        model.children = [leaf("Version", 232), block("Properties70", children=properties)]
        attribute = block("NodeAttribute", ATTRIBUTE_ID + joint, ObjectName("NodeAttribute", ""), "LimbNode")
        attribute.children = [leaf("TypeFlags", "Skeleton")]
        objects += [model, attribute]
        links += [
            leaf("C", "OO", MODEL_ID + joint, MODEL_ID + parent if parent >= 0 else 0),
            leaf("C", "OO", ATTRIBUTE_ID + joint, MODEL_ID + joint),
        ]
    times = np.round(np.arange(len(turns)) * TICKS_PER_SECOND / (fps or source.fps)).astype(np.int64)
    for number, take in enumerate(takes):
        base = TAKE_ID * (number + 1)
        stop = block("Properties70", children=[leaf("P", "LocalStop", "KTime", "Time", "", int(times[-1]))])
        objects.append(block("AnimationStack", base, ObjectName("AnimStack", take), "", children=[stop]))
        objects.append(block("AnimationLayer", base + 1, ObjectName("AnimLayer", "BaseLayer"), ""))
        links.append(leaf("C", "OO", base + 1, base))
        for joint in range(number, len(source.names)):
            tracks = [("Lcl Rotation", degrees[:, joint])]
            if joint == 0:
                tracks.append(("Lcl Translation", offsets[:, 0]))
            for kind, (prop, values) in enumerate(tracks):
                node = base + 100 + 10 * joint + 5 * kind
                added = add_track(node, base + 1, MODEL_ID + joint, prop, times, values, key_flags)
                objects += added[0]
                links += added[1]
    header = block("FBXHeaderExtension", children=[leaf("FBXHeaderVersion", 1003), leaf("FBXVersion", 7400)])
    globals_ = [leaf("P", name, "double", "Number", "", value) for name, value in (settings or {}).items()]
    tree = [header]
    if settings is not None:
        tree.append(block("GlobalSettings", children=[block("Properties70", children=globals_)]))
    return [*tree, block("Objects", children=objects), block("Connections", children=links)]


def add_track(
    number: int,
    layer: int,
    model: int,
    prop: str,
    times: npt.NDArray[np.int64],
    values: Array,
    key_flags: int = LINEAR_KEYS,
) -> tuple[list[FbxNode], list[FbxNode]]:
    """Return objects and connections of curves of a property, with `values` (n, 3) at `times` in ticks."""
    objects = [block("AnimationCurveNode", number, ObjectName("AnimCurveNode", prop[4]), "")]
    links = [leaf("C", "OO", number, layer), leaf("C", "OP", number, model, prop)]
    for axis in range(3):
        objects.append(build_curve(number + 1 + axis, times, values[:, axis], key_flags))
        links.append(leaf("C", "OP", number + 1 + axis, number, f"d|{'XYZ'[axis]}"))
    return objects, links


def build_curve(number: int, times: npt.NDArray[np.int64], values: Array, key_flags: int = LINEAR_KEYS) -> FbxNode:
    """Return a curve with `values` (n,) at `times` in ticks."""
    curve = block("AnimationCurve", number, ObjectName("AnimCurve", ""), "")
    curve.children = [
        leaf("KeyVer", 4008),
        leaf("KeyTime", times),
        leaf("KeyValueFloat", values),
        leaf("KeyAttrFlags", np.array([key_flags])),
        leaf("KeyAttrDataFloat", np.zeros(4)),
        leaf("KeyAttrRefCount", np.array([len(times)])),
    ]
    return curve


def write_fbx_6(source: SourceMotion) -> bytes:
    """Return `source` in ASCII of version 6.1, which has no object numbers, and curves within takes."""
    offsets, turns = local_transforms(source)
    degrees = to_degrees(turns, "XYZ")
    times = np.round(np.arange(len(turns)) * TICKS_PER_SECOND / source.fps).astype(np.int64)
    rest = source.rest_positions
    models: list[str] = []
    links: list[str] = []
    moved: list[str] = []
    for joint, name in enumerate(source.names):
        parent = source.parents[joint]
        place = rest[joint] - rest[parent] if parent >= 0 else offsets[0, 0]
        listed = ",".join(f"{value:.10g}" for value in place)
        models.append(
            f'Model: "Model::{name}", "Limb" {{\nVersion: 232\nProperties60: {{\n'
            f'Property: "RotationActive", "bool", "",1\n'
            f'Property: "Lcl Translation", "Lcl Translation", "A+",{listed}\n'
            f'Property: "Lcl Rotation", "Lcl Rotation", "A+",0,0,0\n}}\n}}'
        )
        links.append(f'Connect: "OO", "Model::{name}", "Model::{source.names[parent] if parent >= 0 else "Scene"}"')
        place_over_time = offsets[:, 0] if joint == 0 else np.tile(place, (len(times), 1))
        channels = [
            _channel_6(letter, times, values) for letter, values in (("T", place_over_time), ("R", degrees[:, joint]))
        ]
        moved.append(f'Model: "Model::{name}" {{\nVersion: 1.1\nChannel: "Transform" {{\n{"".join(channels)}}}\n}}')
    head = "; FBX 6.1.0 project file\nFBXHeaderExtension: {\nFBXHeaderVersion: 1003\nFBXVersion: 6100\n}\n"
    body = "\n".join(models)
    span = f"LocalTime: 0,{times[-1]}\nReferenceTime: 0,{times[-1]}\n"
    takes = (
        f'Takes: {{\nCurrent: "dance"\nTake: "dance" {{\nFileName: "dance.tak"\n{span}{chr(10).join(moved)}\n}}\n}}\n'
    )
    return f"{head}Objects: {{\n{body}\n}}\nConnections: {{\n{chr(10).join(links)}\n}}\n{takes}".encode()


def _channel_6(letter: str, times: npt.NDArray[np.int64], values: Array) -> str:
    curves = []
    for axis in range(3):
        keys = ",".join(f"{time},{value:.10g},L" for time, value in zip(times, values[:, axis], strict=True))
        curves.append(
            f'Channel: "{"XYZ"[axis]}" {{\nDefault: 0\nKeyVer: 4005\nKeyCount: {len(times)}\nKey: {keys}\n}}\n'
        )
    return f'Channel: "{letter}" {{\n{"".join(curves)}LayerType: 1\n}}\n'


def _from_degrees(degrees: Array, order: str) -> Array:
    turn = rotation.IDENTITY
    for name in order:
        axis = "XYZ".index(name)
        turn = rotation.multiply(rotation.from_coordinate_axis(axis, np.radians(degrees[axis])), turn)
    return turn


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
